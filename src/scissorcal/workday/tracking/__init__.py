"""What 'scissorcal track' is fed from and writes: pictures, rigs, a simulated world, recordings."""
