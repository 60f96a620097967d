"""Field, tracking and force loop of Sections IV and V, and what sampling makes of them."""
