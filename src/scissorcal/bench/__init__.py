"""What accuracy costs, and where the model ends: measured, never stated from memory."""
