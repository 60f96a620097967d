"""``defmanip certify``: what it prints, writes and refuses."""

import json
import math
import sys
from importlib.resources import files

import numpy as np
import pytest
from matplotlib.figure import Figure

from defmanip_gym.attack import certificate as certificate_module
from defmanip_gym.attack.result import AttackResult
from defmanip_gym.attack.target import InputLimits, PlantFactors
from defmanip_gym.certification import command, table
from defmanip_gym.certification import ladder as ladder_module
from defmanip_gym.certification.command import run_certify
from defmanip_gym.certification.config import CertifyConfig
from defmanip_gym.certification.ladder import compute_ladder
from defmanip_gym.certification.phase_plot import draw_phase, has_phase_plane
from defmanip_gym.cli import main
from defmanip_gym.errors import CertificateError, ObjectFileError, ParameterError, RecordError
from defmanip_gym.params import GRAVITY_M_S2
from defmanip_gym.theory.certificates import CERTIFICATE_METHODS
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.theory.filters.storage_filter import StorageFilter

HOSE = str(files("defmanip_gym.objects") / "examples" / "hose.xml")
ONE_HINGE = """<mujoco><worldbody><body><site name="grasp"/><geom size=".03" mass=".5"/><body>
    <joint axis="0 -1 0" damping=".1"/><geom size=".05" pos="0 0 -.3" mass="1"/></body></body>
    </worldbody></mujoco>"""


def ladder(**options):
    return compute_ladder(CertifyConfig(**options), lambda _: None)


def test_the_papers_beam_gets_the_whole_ladder_attacked(tmp_path, capsys):
    run_certify(CertifyConfig(damping=1.0, output=tmp_path, longest_attack_s=5.0))
    printed = capsys.readouterr().out
    written = json.loads((tmp_path / "certificates.json").read_text())
    assert set(written["certificates"]) == set(CERTIFICATE_METHODS)
    assert written["certificates"]["tanner"]["nu_max_m_s2"] == pytest.approx(1.089e-3, rel=1e-4)
    assert written["certificates"]["tanner_printed"]["proof"] == "none"
    assert not written["attack"]["is_broken"]
    assert 0.9 < written["certificates"]["l1"]["tightness"] < 1.0
    assert "1.089e-03" in printed and "phase_plane" in printed
    assert (tmp_path / "ladder.png").stat().st_size > 10_000


def test_filters_are_told_beside_the_bounds(tmp_path, capsys):
    run_certify(CertifyConfig(attack=False, output=tmp_path))
    written = json.loads((tmp_path / "certificates.json").read_text())["filters"]["storage"]
    mass, length = CertifyConfig().mass, CertifyConfig().length
    lowest = mass * GRAVITY_M_S2 * length / 2 * (1 - math.cos(math.pi / 6))
    assert written["pass_j"] == pytest.approx(lowest)
    made = StorageFilter()
    assert written["level_share"] == made.level_share and written["at_sigma"] == "segment 1"
    swing = math.acos(1 - made.level_share * (1 - math.cos(made.sigma_rad)))
    assert written["amplitude_share_of_sigma"] == pytest.approx(swing / made.sigma_rad, abs=2e-3)
    printed = capsys.readouterr().out
    assert "segment 1" in printed and f"{100 * made.level_share:.1f}" in printed


@pytest.mark.parametrize(
    "beam", [{}, {"segments": 2, "joint_damping": 0.0}], ids=["one hinge", "two"]
)
def test_of_an_undamped_beam_filters_alone_are_told(beam, tmp_path, capsys):
    run_certify(CertifyConfig(damping=0.0, output=tmp_path, **beam))
    written = json.loads((tmp_path / "certificates.json").read_text())
    assert written["certificates"] == {} and written["attack"] is None
    assert "add damping" in written["refusals"]["l1"]
    assert written["filters"]["storage"]["level_share"] > 0.9
    printed = capsys.readouterr().out
    assert "No bound on the acceleration" in printed and "needs damping" in printed
    assert (tmp_path / "ladder.png").stat().st_size > 5_000


def test_of_many_segments_the_one_at_the_pass_is_named():
    lines = ladder(segments=4, attack=False).filters
    assert [line.name for line in lines] == list(STORAGE_FILTERS)
    assert {line.coordinate for line in lines} == {"segment 4"}
    assert lines[0].amplitude_rad is None
    assert lines[0].pass_j < ladder(attack=False).filters[0].pass_j


def test_a_filter_without_room_says_why(capsys, tmp_path):
    run_certify(CertifyConfig(sigma=0.002, attack=False, output=tmp_path))
    written = json.loads((tmp_path / "certificates.json").read_text())["filters"]["storage"]
    assert written["level_share"] is None and "errors" in written["refusal"]
    assert "No storage filter" in capsys.readouterr().out


def test_sets_of_one_hinge_are_drawn_within_sigma():
    axes = Figure().subplots()
    one = ladder(attack=False)
    draw_phase(axes, one)
    widths = {p.get_label(): np.abs(p.get_xy()[:, 0]).max() for p in axes.patches}
    (reached,) = (width for label, width in widths.items() if "phase_plane" in label)
    assert 0.99 < reached < 1.0 + 1e-6
    for line in one.filters:
        (kept,) = (width for label, width in widths.items() if f"kept by {line.name}," in label)
        assert 0.9 < kept < 1.0
    (most,) = (each.get_xydata() for each in axes.lines if "viable" in str(each.get_label()))
    assert np.abs(most[:, 0]).max() == pytest.approx(1.0)
    assert np.abs(most[:, 1]).max() > one.filters[0].edge[1].max()
    assert not has_phase_plane(ladder(segments=2, attack=False))


def test_of_a_file_the_pass_is_told_as_found_by_a_search(tmp_path, capsys):
    run_certify(CertifyConfig(mjcf=HOSE, attack=False, output=tmp_path))
    printed = " ".join(capsys.readouterr().out.split())
    assert "the lowest pass that a search found" in printed
    written = json.loads((tmp_path / "certificates.json").read_text())
    (line,) = written["filters"].values()
    assert line["at_sigma"] in written["coordinates"] and line["proof"] == "nominal"
    assert 0 < line["level_share"] < 1 and line["pass_j"] > 0


def test_of_an_undamped_object_from_a_file_the_filter_alone_is_told(tmp_path):
    path = tmp_path / "pendulum.xml"
    path.write_text(ONE_HINGE.replace('damping=".1"', ""))
    one = ladder(mjcf=path, attack=False)
    assert one.tightest is None
    swing = 0.3 * 9.81 * (1 - math.cos(math.pi / 6))  # 1 kg at 0.3 m
    assert one.filters[0].pass_j == pytest.approx(swing, rel=1e-3)
    with pytest.raises(CertificateError, match="add damping"):
        ladder(mjcf=path, attack=False, initial_swing=0.6)


def test_a_model_file_is_certified_by_name_of_its_grasp_site():
    hose = ladder(mjcf=HOSE, attack=False)
    assert hose.tightest.method == "l1"
    assert "phase_plane" not in hose.certificates
    assert {certificate.proof for certificate in hose.certificates.values()} == {"none", "linear"}


def test_of_a_file_with_one_hinge_it_says_why_phase_plane_does_not_serve(tmp_path, capsys):
    path = tmp_path / "pendulum.xml"
    path.write_text(ONE_HINGE)
    one = run_certify(CertifyConfig(mjcf=path, attack=False, output=tmp_path))
    written = json.loads((one / "certificates.json").read_text())
    assert "only the linearization is known" in written["refusals"]["phase_plane"]
    printed = capsys.readouterr().out
    assert "needs a beam" in printed and "no room left" not in printed
    with pytest.raises(CertificateError, match="ask for less"):
        ladder(mjcf=path, attack=False, initial_swing=0.6)


def test_an_output_that_is_a_file_is_refused_before_anything_is_computed(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setattr(command, "compute_ladder", lambda *_: pytest.fail("computed"))
    for output in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(RecordError, match="a folder that can be written"):
            run_certify(CertifyConfig(output=output))


def attacked_above(limit):
    """Return an attack that breaks every bound above a limit."""

    def attack(certificate, *, target, longest_s):
        bound, sigma = certificate.acceleration_bound, certificate.sigma_rad
        return AttackResult(
            sigma=sigma,
            certified_bound=bound,
            peak_at_bound=sigma * bound / limit,
            violating_bound=1.004 * limit,
            method="canned",
            coordinate=target.linear.coordinates[0],
            limits=InputLimits(forward_m_s2=1.004 * limit),
            inputs=np.zeros((10, 4)),
            start=np.zeros(2 * target.linear.count),
            timestep_s=target.timestep_s,
            plant=PlantFactors(),
            cpu_seconds=0.0,
        )

    return attack


def test_a_certificate_that_an_attack_breaks_is_never_presented_as_one(
    tmp_path, capsys, monkeypatch
):
    config = CertifyConfig(segments=2, output=tmp_path)
    bound = ladder(segments=2, attack=False).tightest.acceleration_bound
    attack = attacked_above(0.98 * bound)
    monkeypatch.setattr(ladder_module, "attack_certificate", attack)
    monkeypatch.setattr(certificate_module, "attack_certificate", attack)
    with pytest.raises(SystemExit) as ended:
        run_certify(config)
    assert ended.value.code == 1
    printed = capsys.readouterr().out
    assert "BROKEN: l1 is no certificate" in printed and "withstood" in printed
    written = json.loads((tmp_path / "certificates.json").read_text())
    broken = {method for method, each in written["certificates"].items() if each["is_broken"]}
    assert broken == {"l1"}
    assert written["certificates"]["l1"]["tightness"] == pytest.approx(1 / (0.98 * 1.004))
    assert 0.97 * bound < written["attack"]["withstood_bound_m_s2"] <= 0.98 * bound


@pytest.mark.parametrize(
    ("value", "words"),
    [(1.0004, "1.001"), (0.9996, "0.999"), (1.0, "1.000"), (0.12, "0.12"), (None, "–")],
)
def test_a_tightness_off_one_does_not_read_as_one(value, words):
    assert table.tightness_in_words(value) == words


def test_an_elastic_beam_is_described_by_its_bending_stiffness():
    beam = CertifyConfig(bending_stiffness=0.4, segments=4, length=1.2, mass=0.5).beam
    assert beam.segment_count == 4
    assert beam.joint_stiffness == pytest.approx(0.4 / 0.3)
    assert beam.root_stiffness == pytest.approx(2 * beam.joint_stiffness)


def test_intervals_and_conditions_are_those_asked_for():
    narrow = ladder(damping_interval=(0.5, 2.0), vertical_acceleration=0.05, attack=False)
    assert narrow.tightest.intervals.damping == (0.5, 2.0)
    assert narrow.tightest.conditions.vertical_acceleration_m_s2 == 0.05
    assert narrow.tightest.nu_max < ladder(attack=False).tightest.nu_max


def test_methods_without_room_are_left_out_with_their_reason():
    transport = ladder(damping_interval=(0.5, 2.0), transport=True, attack=False)
    assert "lyapunov" not in transport.certificates
    assert "ask for less" in transport.refusals["lyapunov"]


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"damping": 0.0, "initial_swing": 0.6}, CertificateError),
        ({"initial_swing": 0.6}, CertificateError),
        ({"mjcf": "missing.xml"}, ObjectFileError),
        ({"mjcf": HOSE, "grasp_site": "nowhere"}, ObjectFileError),
        ({"segments": 0}, ParameterError),
        ({"bending_stiffness": -1.0}, ParameterError),
        ({"damping_interval": (2.0, 1.0)}, ParameterError),
        ({"yaw_rate": math.nan}, ParameterError),
    ],
)
def test_what_cannot_be_certified_is_refused_in_words(options, error):
    with pytest.raises(error):
        ladder(attack=False, **options)


def test_wrong_options_end_without_a_traceback(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["defmanip", "certify", "--segments", "0", "--no-attack"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


def test_the_command_repeats_what_differs_from_the_defaults():
    config = CertifyConfig(damping=1.0, damping_interval=(0.5, 2.0), attack=False)
    assert config.command == "defmanip certify --damping 1.0 --damping-interval 0.5 2.0 --no-attack"
