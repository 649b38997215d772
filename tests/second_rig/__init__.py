"""A second virtual rig for judging fits, of other construction than scissorcal.device.sim.

It shares no code with it, with scissorcal.model or with the kernel: own geometry, own
Runge-Kutta integrator with located events, own friction with memory, own servo, sensors and hand.
Only plans, labels and recordings are the product's, because any rig is asked by them.

    rig = draw_truth(fine(paper()), rng)
    recipe = recipe_for(rig)
    empty, _ = capture_friction(rig, recipe, rng)
    cut, books = capture_cut(rig, recipe, rng)
    truth = true_parameters(rig, reference_indentation_m=1.5e-4, angle_center=0.5)
"""

from .capture import (
    Interruption,
    capture_cut,
    capture_friction,
    capture_friction_advance,
    driven_timeline,
    identity_of,
)
from .parameters import (
    Blades,
    Friction,
    Hand,
    Material,
    Mechanism,
    Motor,
    Rig,
    Sensors,
    Servo,
    draw_truth,
)
from .presets import coarse, cotton, fine, pad, paper, recipe_for, smooth
from .simulate import Books, Timeline, run
from .truth import true_parameters

__all__ = [
    "Blades",
    "Books",
    "Friction",
    "Hand",
    "Interruption",
    "Material",
    "Mechanism",
    "Motor",
    "Rig",
    "Sensors",
    "Servo",
    "Timeline",
    "capture_cut",
    "capture_friction",
    "capture_friction_advance",
    "coarse",
    "cotton",
    "draw_truth",
    "driven_timeline",
    "fine",
    "identity_of",
    "pad",
    "paper",
    "recipe_for",
    "run",
    "smooth",
    "true_parameters",
]
