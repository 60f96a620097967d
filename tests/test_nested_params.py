"""Mappings in the place of nested parameters change what they name, and nothing else."""

from dataclasses import dataclass, field, fields, is_dataclass

import pytest

from defmanip_gym.baselines.analytic.field import FieldParams
from defmanip_gym.baselines.analytic.lqr import LqrParams
from defmanip_gym.baselines.analytic.mpc_params import MpcParams
from defmanip_gym.baselines.analytic.shaped import ShapedParams
from defmanip_gym.baselines.analytic.tanner_params import TannerParams
from defmanip_gym.baselines.analytic.time_optimal_params import TimeOptimalParams
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.validation import plain, require_params, require_positive, settle

KINDS = (
    *(FieldParams, LqrParams, MpcParams, ShapedParams, TannerParams, TimeOptimalParams),
    *(RobotParams, TaskParams, TransportConfig),
)
NESTED = [
    (kind, each.name)
    for kind in KINDS
    for each in fields(kind)
    if is_dataclass(getattr(kind(), each.name))
]


@pytest.mark.parametrize(("kind", "name"), NESTED, ids=lambda each: getattr(each, "__name__", each))
def test_what_a_mapping_does_not_name_is_as_in_the_outer_default(kind, name):
    default = getattr(kind(), name)
    assert getattr(kind(**{name: {}}), name) == default
    assert getattr(kind(**{name: plain(default)}), name) == default


def test_what_a_mapping_names_is_changed():
    way = FieldParams(way={"turn_radius_m": 3.0}).way
    assert (way.turn_radius_m, way.deceleration_m_s2) == (3.0, FieldParams().way.deceleration_m_s2)


@dataclass(frozen=True, kw_only=True)
class Inner:
    one: float = 1.0
    two: float = 2.0

    def __post_init__(self):
        settle(self, "one", require_positive)


@dataclass(frozen=True, kw_only=True)
class Middle:
    inner: Inner = Inner()

    def __post_init__(self):
        settle(self, "inner", require_params, Inner)


@dataclass(frozen=True, kw_only=True)
class Outer:
    middle: Middle = field(default_factory=lambda: Middle(inner=Inner(one=10.0, two=20.0)))

    def __post_init__(self):
        settle(self, "middle", require_params, Middle)


def test_mappings_within_mappings_keep_the_outermost_default():
    assert Outer(middle={"inner": {"two": 5.0}}).middle.inner == Inner(one=10.0, two=5.0)


def test_a_misspelt_field_is_shown_as_it_was_written():
    with pytest.raises(ParameterError, match=r"\['thre', 'two'\]"):
        Middle(inner={"thre": 1.0, "two": 2.0})
