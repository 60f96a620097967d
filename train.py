"""Train an agent: ``python train.py --help``."""

from defmanip_gym.cli import train_main

if __name__ == "__main__":
    train_main()
