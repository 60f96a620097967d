"""Compare controllers: ``python evaluate.py --help``."""

from defmanip_gym.cli import evaluate_main

if __name__ == "__main__":
    evaluate_main()
