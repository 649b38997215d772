"""Every quantity from the everyday to the absurd: model, kernel, estimation, vision, imports."""
