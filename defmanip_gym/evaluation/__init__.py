"""Paired comparison of controllers: rollouts to records, records to statistics and reports."""
