"""Rotations of single vectors, in plain arithmetic: a row of the filter takes some of them.

SciPy's Rotation costs 5 to 20 us a call, which the filter's budget of 100 us a row does not
have; tests compare both.
"""

import math

import numpy as np

from scissorcal.aliases import Array

_SMALL = 1e-6
_THRICE = 3.0 * np.eye(3)


def rotation_of(vector: Array) -> Array:
    """The rotation matrix (3, 3) of a rotation vector (3,) in rad (Rodrigues' formula).

    >>> rotation_of(np.array([0.0, 0.0, np.pi / 2])).round(6) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    x, y, z = float(vector[0]), float(vector[1]), float(vector[2])
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < _SMALL:
        first, second = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        first, second = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    a, b, c = first * x, first * y, first * z
    xy, xz, yz = second * x * y, second * x * z, second * y * z
    xx, yy, zz = second * x * x, second * y * y, second * z * z
    return np.array(
        [
            [1.0 - yy - zz, xy - c, xz + b],
            [xy + c, 1.0 - xx - zz, yz - a],
            [xz - b, yz + a, 1.0 - xx - yy],
        ]
    )


def rotation_vector(matrix: Array) -> Array:
    """The rotation vector (3,) in rad of a rotation matrix (3, 3), of length pi at most.

    By the quaternion whose largest component is computed first (Shepperd 1978,
    doi:10.2514/3.55767b), so it is accurate up to and at half a turn.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = matrix.tolist()
    trace = r00 + r11 + r22
    if trace >= max(r00, r11, r22):
        w, x, y, z = 1.0 + trace, r21 - r12, r02 - r20, r10 - r01
    elif r00 >= max(r11, r22):
        w, x, y, z = r21 - r12, 1.0 + r00 - r11 - r22, r01 + r10, r02 + r20
    elif r11 >= r22:
        w, x, y, z = r02 - r20, r01 + r10, 1.0 + r11 - r00 - r22, r12 + r21
    else:
        w, x, y, z = r10 - r01, r02 + r20, r12 + r21, 1.0 + r22 - r00 - r11
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return np.zeros(3)
    share = math.copysign(2.0 * math.atan2(sine, abs(w)) / sine, w)
    return np.array([share * x, share * y, share * z])


def pose_error(rotation: Array, place_m: Array, true_rotation: Array, true_place_m: Array) -> Array:
    """Error (6,) of an estimated pose: rotation vector (rad) and way (m) that lead to the truth.

    True rotation = Exp(error[:3]) estimated rotation, the error that the filter's covariance is of.
    """
    turn = rotation_vector(true_rotation @ rotation.T)
    return np.concatenate([turn, np.subtract(true_place_m, place_m)])


def cross(a: Array, b: Array) -> Array:
    """Cross product of two vectors (3,); ten times as fast as NumPy's on single vectors."""
    ax, ay, az = float(a[0]), float(a[1]), float(a[2])
    bx, by, bz = float(b[0]), float(b[1]), float(b[2])
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def cross_matrix(vector: Array) -> Array:
    """The matrix (3, 3) whose product with a vector is the cross product."""
    x, y, z = float(vector[0]), float(vector[1]), float(vector[2])
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def nearest_rotation(matrix: Array) -> Array:
    """The rotation nearest to a matrix that rounding has moved off: one Newton step.

    A step of X <- X (3 - X^T X) / 2 squares the deviation from orthogonality (Higham 1986,
    doi:10.1137/0907079); after each product of the filter it stands near 1e-16.
    """
    return np.asarray(0.5 * matrix @ (_THRICE - matrix.T @ matrix))
