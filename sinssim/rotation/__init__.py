"""Rotations: quaternion, direction cosine matrix, Euler angles, rotation vector; kernels, and functions over arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.rotation.arrays import (
        conjugate,
        dcm_from_quaternion,
        euler_from_quaternion,
        multiply,
        normalize,
        quaternion_from_dcm,
        quaternion_from_euler,
        quaternion_from_rotation_vector,
        rotate,
        rotation_vector_from_quaternion,
    )
    from sinssim.rotation.kernels import (
        SERIES,
        Matrix,
        Quaternion,
        Vector,
        cross_k,
        dcm_from_quaternion_k,
        euler_from_quaternion_k,
        half_angle_series_k,
        multiply_k,
        quaternion_from_dcm_k,
        quaternion_from_euler_k,
        quaternion_from_rotation_vector_k,
        rotate_k,
        rotation_series_k,
        rotation_vector_from_quaternion_k,
        sincos_k,
        small_rotation_series_k,
    )

__all__ = [
    "SERIES",
    "Matrix",
    "Quaternion",
    "Vector",
    "conjugate",
    "cross_k",
    "dcm_from_quaternion",
    "dcm_from_quaternion_k",
    "euler_from_quaternion",
    "euler_from_quaternion_k",
    "half_angle_series_k",
    "multiply",
    "multiply_k",
    "normalize",
    "quaternion_from_dcm",
    "quaternion_from_dcm_k",
    "quaternion_from_euler",
    "quaternion_from_euler_k",
    "quaternion_from_rotation_vector",
    "quaternion_from_rotation_vector_k",
    "rotate",
    "rotate_k",
    "rotation_series_k",
    "rotation_vector_from_quaternion",
    "rotation_vector_from_quaternion_k",
    "sincos_k",
    "small_rotation_series_k",
]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "Matrix": "sinssim.rotation.kernels",
        "Quaternion": "sinssim.rotation.kernels",
        "SERIES": "sinssim.rotation.kernels",
        "Vector": "sinssim.rotation.kernels",
        "conjugate": "sinssim.rotation.arrays",
        "cross_k": "sinssim.rotation.kernels",
        "dcm_from_quaternion": "sinssim.rotation.arrays",
        "dcm_from_quaternion_k": "sinssim.rotation.kernels",
        "euler_from_quaternion": "sinssim.rotation.arrays",
        "euler_from_quaternion_k": "sinssim.rotation.kernels",
        "half_angle_series_k": "sinssim.rotation.kernels",
        "multiply": "sinssim.rotation.arrays",
        "multiply_k": "sinssim.rotation.kernels",
        "normalize": "sinssim.rotation.arrays",
        "quaternion_from_dcm": "sinssim.rotation.arrays",
        "quaternion_from_dcm_k": "sinssim.rotation.kernels",
        "quaternion_from_euler": "sinssim.rotation.arrays",
        "quaternion_from_euler_k": "sinssim.rotation.kernels",
        "quaternion_from_rotation_vector": "sinssim.rotation.arrays",
        "quaternion_from_rotation_vector_k": "sinssim.rotation.kernels",
        "rotate": "sinssim.rotation.arrays",
        "rotate_k": "sinssim.rotation.kernels",
        "rotation_series_k": "sinssim.rotation.kernels",
        "rotation_vector_from_quaternion": "sinssim.rotation.arrays",
        "rotation_vector_from_quaternion_k": "sinssim.rotation.kernels",
        "sincos_k": "sinssim.rotation.kernels",
        "small_rotation_series_k": "sinssim.rotation.kernels",
    },
)
