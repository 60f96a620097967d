"""``defmanip certify``: compute, print, write."""

from __future__ import annotations

import json
from pathlib import Path

from rich.console import Console

from defmanip_gym.certification.config import CertifyConfig
from defmanip_gym.certification.filter_table import filter_table
from defmanip_gym.certification.ladder import compute_ladder
from defmanip_gym.certification.plot import save_plot
from defmanip_gym.certification.table import ladder_table, numbers, remarks
from defmanip_gym.errors import RecordError
from defmanip_gym.files import require_writable, write_atomically

NUMBERS_FILE = "certificates.json"


def run_certify(config: CertifyConfig) -> Path:
    """Print the ladder for an object, write plot and numbers, return their folder.

    Ctrl-C ends it with 130, there is nothing to keep; a broken certificate with 1, all written.

    Raises:
        CertificateError: no method gives a certificate under these conditions.
        ObjectFileError: the model file cannot be used.
        RecordError: the output folder cannot be written.
    """
    console = Console()
    try:
        require_writable(config.output / NUMBERS_FILE)
        with console.status("linearizing") as status:
            ladder = compute_ladder(config, status.update)
            console.print(ladder_table(ladder))
            console.print(filter_table(ladder))
            for line in remarks(ladder):
                console.print(line, highlight=False)
            status.update("writing")
            content = json.dumps(numbers(config, ladder), indent=2, ensure_ascii=False)
            write_atomically(config.output / NUMBERS_FILE, content.encode())
            save_plot(config.output / "ladder.png", ladder)
    except KeyboardInterrupt:
        console.print("Stopped; nothing was written.")
        raise SystemExit(130) from None
    except OSError as error:
        raise RecordError(
            "output", str(config.output), "a folder that can be written", f"{error}."
        ) from error
    console.print(f"Plot and numbers: {config.output.resolve()}", soft_wrap=True, highlight=False)
    if ladder.attack is not None and ladder.attack.is_broken:
        raise SystemExit(1)
    return config.output
