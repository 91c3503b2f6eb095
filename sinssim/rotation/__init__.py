"""Rotations: quaternion, direction cosine matrix, Euler angles, rotation vector; kernels, and functions over arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.rotation.quaternions import HEADING_RANGES as HEADING_RANGES
    from sinssim.rotation.quaternions import SERIES as SERIES
    from sinssim.rotation.quaternions import Matrix as Matrix
    from sinssim.rotation.quaternions import Quaternion as Quaternion
    from sinssim.rotation.quaternions import Vector as Vector
    from sinssim.rotation.quaternions import conjugate as conjugate
    from sinssim.rotation.quaternions import continuous_angles as continuous_angles
    from sinssim.rotation.quaternions import cross_k as cross_k
    from sinssim.rotation.quaternions import dcm_from_quaternion as dcm_from_quaternion
    from sinssim.rotation.quaternions import dcm_from_quaternion_k as dcm_from_quaternion_k
    from sinssim.rotation.quaternions import euler_from_quaternion as euler_from_quaternion
    from sinssim.rotation.quaternions import euler_from_quaternion_k as euler_from_quaternion_k
    from sinssim.rotation.quaternions import half_angle_series_k as half_angle_series_k
    from sinssim.rotation.quaternions import heading_in as heading_in
    from sinssim.rotation.quaternions import multiply as multiply
    from sinssim.rotation.quaternions import multiply_k as multiply_k
    from sinssim.rotation.quaternions import normalize as normalize
    from sinssim.rotation.quaternions import quaternion_from_dcm as quaternion_from_dcm
    from sinssim.rotation.quaternions import quaternion_from_dcm_k as quaternion_from_dcm_k
    from sinssim.rotation.quaternions import quaternion_from_euler as quaternion_from_euler
    from sinssim.rotation.quaternions import quaternion_from_euler_k as quaternion_from_euler_k
    from sinssim.rotation.quaternions import quaternion_from_rotation_vector as quaternion_from_rotation_vector
    from sinssim.rotation.quaternions import quaternion_from_rotation_vector_k as quaternion_from_rotation_vector_k
    from sinssim.rotation.quaternions import rotate as rotate
    from sinssim.rotation.quaternions import rotate_k as rotate_k
    from sinssim.rotation.quaternions import rotation_series_k as rotation_series_k
    from sinssim.rotation.quaternions import rotation_vector_from_quaternion as rotation_vector_from_quaternion
    from sinssim.rotation.quaternions import rotation_vector_from_quaternion_k as rotation_vector_from_quaternion_k
    from sinssim.rotation.quaternions import shown_heading as shown_heading
    from sinssim.rotation.quaternions import sincos_k as sincos_k
    from sinssim.rotation.quaternions import small_rotation_series_k as small_rotation_series_k

__getattr__, __dir__, __all__ = on_first_use(__name__)
