"""Transport of deformable objects under certified deformation bounds.

Importing the package registers ``DeformTransport-v0`` with Gymnasium.
"""

from defmanip_gym.envs.registration import register_environments
from defmanip_gym.envs.state import get_state, set_state
from defmanip_gym.version import __version__

__all__ = ["__version__", "get_state", "set_state"]

register_environments()
