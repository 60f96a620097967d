"""The transport task as Gymnasium environments over one batched engine."""
