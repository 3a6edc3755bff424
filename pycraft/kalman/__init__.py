"""The Kalman dictionary: a linear state-space model as an SKO tree, its filter and smoother as operator expressions.

A state-space model is a chain: time step t is a body, its state takes the place of a rigid body's spatial force, and the tip-to-base sweep
runs forward in time, so the tip is the first step and the base the last. Then the articulated-body inertia P is the covariance of the
predicted state, G the Kalman gain, ε = [I - HψK]y the innovations, and every identity of the algebra is one about filters: the mass matrix
ℳ + J = HφMφ*H* + J is the covariance of all measurements, its innovations factors whiten them, ln det(ℳ + J) = Σ ln det D is the term of
the likelihood. [G. Rodriguez, "Kalman filtering, smoothing and recursive robot arm forward and inverse dynamics", IEEE J. Robotics and
Automation 3(6), 1987; A. Jain, Robot and Multibody Dynamics, Springer 2011]
"""

from .dictionary import Dictionary
from .state_space import Filtered, Smoothed, StateSpace, kalman

__all__ = ["Dictionary", "Filtered", "Smoothed", "StateSpace", "kalman"]
