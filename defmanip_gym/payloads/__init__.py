"""What a robot carries: its coordinates, what is believed of it, and its body in the plant."""
