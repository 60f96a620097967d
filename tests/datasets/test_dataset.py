"""Datasets load with Minari alone, are made again bit for bit, and are whole or not there."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("minari")
pytest.importorskip("h5py")

import h5py
import minari
from small_agents import small_agent

from defmanip_gym.datasets import collection, command
from defmanip_gym.datasets.config import DatasetConfig
from defmanip_gym.datasets.minari_access import open_dataset
from defmanip_gym.datasets.reference_scores import ReferenceScores
from defmanip_gym.errors import DatasetError
from defmanip_gym.evaluation.seeds import dataset_seed
from defmanip_gym.theory.filters.storage_filter import StorageFilter

NAME = "deform-transport/mixed-v0"
ALONE = """
import minari
dataset = minari.load_dataset("deform-transport/mixed-v0")
import sys
assert not any(name.startswith("defmanip_gym") for name in sys.modules)
env = dataset.recover_environment()
for number, metadata in enumerate(dataset.storage.get_episode_metadata(range(4))):
    observation, info = env.reset(seed=metadata["seed"])
    assert (observation == dataset[number].observations[0]).all()
    assert env.unwrapped.config.inner_loop == "measured_force"
assert list(minari.list_local_datasets()) == ["deform-transport/mixed-v0"]
"""


def settings(output, **changes):
    given = {"name": NAME, "contestants": ("field", "random"), "shares": (3.0, 1.0), "episodes": 4}
    return DatasetConfig(**(given | {"output": output} | changes))


def check(root, named=NAME):
    command.run_dataset(DatasetConfig(check=named, output=root))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Return a folder of datasets with one of them; no test changes it."""
    root = tmp_path_factory.mktemp("datasets")
    command.run_dataset(settings(root))
    return root


@pytest.fixture
def copied(written, tmp_path):
    """Return a copy of that folder, and the file of the episodes in it."""
    root = tmp_path / "copy"
    shutil.copytree(written, root)
    return root, root / NAME / "data" / "main_data.hdf5"


@pytest.fixture
def quick(monkeypatch):
    """Skip the episodes of the reference scores."""
    scores = ReferenceScores(worst=0.0, best=1.0)
    monkeypatch.setattr(command, "reference_scores", lambda *_: scores)


def test_minari_alone_loads_it_and_recovers_the_environment(written):
    environment = os.environ | {"MINARI_DATASETS_PATH": str(written)}
    subprocess.run([sys.executable, "-c", ALONE], env=environment, check=True, timeout=300)


def test_episodes_are_of_the_contestants_in_their_shares(written):
    dataset = open_dataset(NAME, written)
    metadata = list(dataset.storage.get_episode_metadata(range(4)))
    assert [each["contestant"] for each in metadata] == ["field"] * 3 + ["random"]
    assert [each["seed"] for each in metadata] == [dataset_seed(0, k) for k in range(4)]
    returns = [episode.rewards.sum() for episode in dataset]
    *analytic, random = minari.get_normalized_score(dataset, np.array(returns))
    assert min(analytic) > 0.8 and random < 0.5
    for episode in list(dataset)[:3]:
        assert episode.infos["is_success"].sum() == episode.infos["is_success"][-1] == 1
        assert episode.terminations[-1] and not episode.infos["cost"].any()
        assert "wished_action" not in episode.infos


def test_metadata_say_what_made_it(written):
    metadata = open_dataset(NAME, written).storage.metadata
    assert metadata["author"] == {"the defmanip_gym contributors"}
    assert metadata["algorithm_name"] == "field, random" and "code_permalink" not in metadata
    assert "3 of field, 1 of random" in metadata["description"]
    own = metadata["defmanip_gym"]
    assert own["version"] in metadata["requirements"][0] and own["inner_loop"] == "measured_force"
    field, random = own["parts"]
    assert field["controller"]["identity"]["params"] and random["controller"]
    assert metadata["ref_min_score"] < 0 < metadata["ref_max_score"]


def test_the_check_finds_every_bit_again(written, capsys):
    check(written, str(written / NAME))
    assert "4 episodes are the same again" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("where", "step", "said"),
    [
        ("observations", 7, "episode 1, step 7, observations"),
        ("rewards", 7, "episode 1, step 7, rewards"),
        ("infos/cost", 7, "episode 1, step 7, costs"),
        ("terminations", 7, "episode 1, step 7, terminations"),
        ("truncations", 7, "episode 1, step 7, truncations"),
        ("actions", 7, "episode 1, step 8, observations"),
    ],
)
def test_what_was_changed_is_told_with_episode_and_step(copied, where, step, said, capsys):
    root, path = copied
    with h5py.File(path, "a") as file:
        values = file[f"episode_1/{where}"]
        row = values[step]
        values[step] = ~row if row.dtype == bool else np.nextafter(row, 2.0)
    with pytest.raises(SystemExit) as end:
        check(root)
    answer = capsys.readouterr().out
    assert end.value.code == 1
    assert said in answer and "1 of 4 episodes differ" in answer


def test_an_episode_that_goes_on_too_long_differs(copied, capsys):
    root, path = copied
    with h5py.File(path, "a") as file:
        for name in ("actions", "rewards", "terminations", "truncations"):
            values = file[f"episode_3/{name}"]
            values.resize(len(values) + 1, axis=0)
    with pytest.raises(SystemExit):
        check(root)
    assert "steps: stored" in capsys.readouterr().out


def test_environments_of_others_are_not_made(copied):
    root, path = copied
    metadata = path.with_name("metadata.json")
    metadata.write_text(metadata.read_text().replace("defmanip_gym.envs.def", "elsewhere.envs.def"))
    with pytest.raises(DatasetError, match="this package"):
        check(root)


def test_missing_and_damaged_datasets_end_in_messages(copied, tmp_path):
    root, path = copied
    with pytest.raises(DatasetError, match="--output"):
        check(tmp_path)
    with h5py.File(path, "a") as file:
        del file["episode_2/infos/cost"]
    with pytest.raises(DatasetError, match="episode 2"):
        check(root)
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(DatasetError):
        check(root)


def test_inside_a_filter_the_filtered_action_is_stored_beside_the_wished_one(
    tmp_path, quick, capsys
):
    changes = {"contestants": ("tanner/tanner",), "shares": None, "episodes": 2}
    plant = {"env": "DeformTransportRandomized-v0", "constraint_mode": "cost"}
    command.run_dataset(settings(tmp_path, **changes, **plant))
    for episode in open_dataset(NAME, tmp_path):
        wished = episode.infos["wished_action"]
        assert wished.shape == (len(episode) + 1, 3) and not wished[0].any()
        assert (np.abs(episode.actions[:, 0]) < np.abs(wished[1:, 0])).any()
    check(tmp_path)
    assert "2 episodes are the same again" in capsys.readouterr().out


def test_batches_make_no_difference(written, tmp_path, quick, monkeypatch):
    monkeypatch.setattr(collection, "_BATCH", 2)
    command.run_dataset(settings(tmp_path))
    for once, again in zip(open_dataset(NAME, written), open_dataset(NAME, tmp_path), strict=True):
        assert np.array_equal(once.observations, again.observations)
        assert np.array_equal(once.actions, again.actions)


def test_a_dataset_is_replaced_only_when_asked_for(copied, quick):
    root, _ = copied
    with pytest.raises(DatasetError, match="--overwrite"):
        command.run_dataset(settings(root))
    other = settings(root, contestants=("zero",), shares=None, episodes=1, overwrite=True)
    command.run_dataset(other)
    assert open_dataset(NAME, root).total_episodes == 1


def test_what_is_no_dataset_is_never_replaced(tmp_path, quick):
    (tmp_path / NAME).mkdir(parents=True)
    with pytest.raises(DatasetError, match="free id"):
        command.run_dataset(settings(tmp_path, overwrite=True))


@pytest.mark.parametrize("overwrite", [False, True])
def test_an_interruption_leaves_what_was_there(copied, tmp_path, quick, monkeypatch, overwrite):
    root = copied[0] if overwrite else tmp_path / "new"
    before = sorted(path.name for path in root.rglob("*"))
    episodes_of = command.episodes_of

    def interrupted(part, env):
        yield from episodes_of(part, env)
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "episodes_of", interrupted)
    with pytest.raises(SystemExit) as end:
        command.run_dataset(settings(root, contestants=("zero",), shares=None, overwrite=overwrite))
    assert end.value.code == 130
    assert sorted(path.name for path in root.rglob("*")) == before


def test_an_agent_controls_inside_the_filter_that_it_learned_in(tmp_path, quick):
    specification = StorageFilter().specification
    small_agent(safety_filter="storage", filter_specification=specification).save(
        tmp_path / "run" / "agent"
    )
    small_agent(seed=1).save(tmp_path / "free" / "agent")
    agents = (tmp_path / "run", tmp_path / "free")
    made = settings(tmp_path, contestants=(), agents=agents, shares=None, episodes=2)
    command.run_dataset(made)
    inside, alone = open_dataset(NAME, tmp_path)
    assert (inside.infos["wished_action"][1:] != inside.actions).any()
    assert not inside.infos["cost"].any()
    assert "wished_action" not in alone.infos
    check(tmp_path)


def test_no_dataset_lies_within_another(written):
    with pytest.raises(DatasetError, match="outside of the dataset"):
        command.run_dataset(settings(written, name=f"{NAME}/inner-v0"))


def test_what_somebody_else_wrote_meanwhile_stays(tmp_path, quick, monkeypatch):
    def meanwhile(part, env):
        (tmp_path / NAME / "data").mkdir(parents=True)
        return iter(())

    monkeypatch.setattr(command, "episodes_of", meanwhile)
    with pytest.raises(DatasetError):
        command.run_dataset(settings(tmp_path, contestants=("zero",), shares=None))
    assert [path.name for path in tmp_path.iterdir()] == [NAME.partition("/")[0]]
    assert (tmp_path / NAME / "data").is_dir()
