"""``python -m defmanip_gym`` is ``defmanip``."""

from defmanip_gym.cli import main

if __name__ == "__main__":
    main()
