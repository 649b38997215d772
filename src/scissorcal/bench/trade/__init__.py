"""How cost buys accuracy, one knob at a time and then together."""
