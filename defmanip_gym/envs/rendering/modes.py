"""The kinds of images, by Gymnasium's names."""

from __future__ import annotations

from defmanip_gym.validation import require_choice

IMAGE_MODES = ("rgb_array", "depth_array")
RENDER_MODES = ("human", *IMAGE_MODES)


class RenderModes(list[str]):
    """Modes as in an environment's ``metadata``: a list that refuses what is no name.

    ``gymnasium.make`` looks up a mode here before it asks the environment, and takes one that it
    does not find for a string.
    """

    def __contains__(self, mode: object) -> bool:
        """Return whether it is one of these.

        Raises:
            ParameterError: neither a string nor None.
        """
        if mode is not None and not isinstance(mode, str):
            require_choice("render_mode", mode, self)
        return super().__contains__(mode)
