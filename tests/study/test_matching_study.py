"""The matching study: it says yes where matching steers, no where it does not, and writes its page itself."""

from __future__ import annotations

import json
import shutil
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import torch
from click.testing import CliRunner, Result
from scipy import stats

from pdtui.cli import main
from pdtui.core.errors import SeedError, StudyError
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.policies.weights.weights_file import load_network, save_network
from pdtui.study.matching.matching_study_plan import load_matching_study_plan, parse_matching_study_plan
from pdtui.study.matching.study_data import ROLES, read_study_data, write_study_data
from pdtui.study.matching.study_page import answer_in_one_sentence, compose_study_page
from pdtui.study.matching.study_statistics import StudyAnswer, analyze_study
from tests.study.planted_study import PLAN, plant_study, small_plan


@pytest.mark.parametrize(
    ("policies", "share", "answer", "sentence"),
    [
        (10, 1.0, StudyAnswer.YES, "Yes, matching finds what steers: on 10 policies, the first match is"),
        (10, 0.35, StudyAnswer.SELDOM, "Better than chance, but seldom: on 10 policies"),
        (10, 0.0, StudyAnswer.NO, "No evidence that matching finds what steers: on 10 policies"),
        (5, 1.0, StudyAnswer.UNKNOWN, "Unknown: 5 policies that walk are too few"),
    ],
)
def test_the_answer_is_what_was_planted(
    policies: int, share: float, answer: StudyAnswer, sentence: str
) -> None:
    data = plant_study(policies, share)
    result = analyze_study(data)
    assert result.answer is answer
    assert answer_in_one_sentence(data, result).startswith(sentence)
    page = compose_study_page(data, result)
    assert sentence in page
    assert f"on {policies} of the\n3 policies planned" in page
    assert result.random.mean == pytest.approx(0.1, abs=0.06)
    assert result.probing.mean > 0.9


def test_matching_that_does_nothing_seldom_passes() -> None:
    found = [analyze_study(plant_study(8, 0.0, seed)).answer for seed in range(20)]
    assert sum(answer is not StudyAnswer.NO for answer in found) <= 4


def test_figures_are_those_of_an_independent_computation() -> None:
    data = plant_study(7, 0.5, seed=3)
    result = analyze_study(data)
    figures: list[list[float]] = []
    for policy in data.policies:
        per_attribute = []
        for one in data.measured:
            if one.policy != policy.name:
                continue
            held_out = (one.effects[1] + one.effects[2]) / 2
            strength = np.maximum(np.abs(held_out[0]), np.abs(held_out[1]))
            bar = np.percentile(strength[one.roles == ROLES.index("reference")], 90)
            order = np.argsort(one.ranks[0])
            drawn = one.roles < ROLES.index("matched")
            rises = held_out[1] > held_out[0]
            per_attribute.append(
                (
                    strength[order[0]] > bar,
                    np.mean(strength[order[:2]] > bar),
                    stats.spearmanr(-one.ranks[0].astype(int)[drawn], strength[drawn]).statistic,
                    np.mean((one.correlations[0] > 0)[order[:2]] == rises[order[:2]]),
                    np.mean(strength[one.roles == ROLES.index("random")] > bar),
                )
            )
        figures.append(np.mean(per_attribute, axis=0).tolist())
    hits, bests, correlations, signs, randoms = zip(*figures, strict=True)
    found = result.variants["paper, scaled"]
    assert [tested.mean for tested in found] == pytest.approx(
        [np.mean(x) for x in (hits, bests, correlations, signs)]
    )
    assert result.random.mean == pytest.approx(np.mean(randoms))
    chances = (randoms, randoms, [0.0] * 7, [0.5] * 7)
    for tested, values, chance in zip(found, (hits, bests, correlations, signs), chances, strict=True):
        differences = np.array(values) - np.array(chance)
        means = [abs(np.mean(differences * flips)) for flips in product((1.0, -1.0), repeat=7)]
        assert tested.p == pytest.approx(np.mean(np.array(means) >= abs(differences.mean()) - 1e-12))
        assert tested.low <= tested.mean <= tested.high
    tests = [tested for row in result.variants.values() for tested in row]
    everything, corrected = [tested.p for tested in tests], [tested.corrected for tested in tests]
    assert corrected == pytest.approx(stats.false_discovery_control(everything).tolist())


def test_data_are_read_as_they_were_written(tmp_path: Path) -> None:
    data = plant_study(3, 0.5)
    path = tmp_path / "study.parquet"
    write_study_data(path, data)
    read = read_study_data(path)
    assert (read.plan, read.policies) == (data.plan, data.policies)
    for one, other in zip(read.measured, data.measured, strict=True):
        assert (one.policy, one.attribute) == (other.policy, other.attribute)
        np.testing.assert_array_equal(one.ranks, other.ranks)
        np.testing.assert_allclose(one.effects, other.effects, rtol=5e-3, atol=1e-6)
        np.testing.assert_allclose(one.correlations, other.correlations, atol=0.005)
    write_study_data(path, read)
    assert [one.effects.tolist() for one in read_study_data(path).measured] == [
        one.effects.tolist() for one in read.measured
    ]
    with pytest.raises(StudyError, match="expected the data of a matching study, found no file"):
        read_study_data(tmp_path / "none.parquet")
    path.write_bytes(b"PAR1")
    with pytest.raises(StudyError, match="expected the data of a matching study"):
        read_study_data(path)


@pytest.mark.parametrize(
    ("old", "new", "error", "message"),
    [
        ('seeds = "4000-4001"', 'seeds = "4-5"', SeedError, "monitoring: seed 4 is reserved for judging"),
        ("held_out_starts = 2", "held_out_starts = 3", StudyError, "expected an even number"),
        (
            'primary = "paper, scaled"',
            'primary = "best"',
            StudyError,
            "primary: expected one of paper, scaled",
        ),
        ("level = 0.05", "", StudyError, "expected the plan of a matching study: KeyError"),
        ("[walking]", "[walking", StudyError, "expected the plan of a matching study"),
    ],
)
def test_a_plan_that_makes_no_sense_is_refused(
    old: str, new: str, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        parse_matching_study_plan(PLAN.replace(old, new), "small plan")


def test_the_plan_of_the_guide_wants_24_policies() -> None:
    plan = load_matching_study_plan()
    assert len({one.name for one in plan.policies}) == 24
    assert all(one.seed >= 1000 for one in plan.policies if not one.shipped)
    assert len(plan.variants) == 8
    assert max(sum(one.setting == other.setting for other in plan.policies) for one in plan.policies) >= 5
    imitating = next(one for one in plan.policies if one.imitation_rounds)
    assert imitating.command("runs/study") == (
        "pdtui train walker --algorithm ppo --activation relu --initial-policy walker --imitation-rounds 1 "
        "--layers 256,256 --seed 1000 --steps 2048 --folder runs/study/walker-ppo-relu-256x256-1000"
    )


def _run(*arguments: str | Path) -> Result:
    return CliRunner(env={"COLUMNS": "220"}).invoke(main, ["study", "matching", *map(str, arguments)])


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Policies of the small plan: the shipped one of the Walker, one that falls, and one not finished."""
    folder = tmp_path_factory.mktemp("policies")
    (folder / "plan.toml").write_text(PLAN)
    for policy, steps in zip(small_plan().policies, (5000, 5000, 4000), strict=True):
        own = folder / policy.name
        own.mkdir()
        shutil.copy(find_weights_file("walker"), own / "best.safetensors")
        (own / "log.jsonl").write_text(json.dumps({"steps": 0}) + "\n" + json.dumps({"steps": steps}) + "\n")
    broken = load_network(find_weights_file("walker"))
    with torch.no_grad():
        broken.head.weight.neg_()
    save_network(folder / "walker-ppo-tanh-256x256-1001" / "best.safetensors", broken)
    return folder


def test_a_small_study_from_policies_to_the_page(trained: Path, tmp_path: Path) -> None:
    folder, guide = tmp_path / "measured", tmp_path / "guide"
    options = ("--plan", trained / "plan.toml", "--policies", trained, "--folder", folder, "--workers", "1")
    first = _run(*options, "--guide", guide)
    assert first.exit_code == 0, first.output
    assert "Matching and steering: 1 of the 3 policies wanted" in first.stdout
    assert "Unknown: one policy that walks is too few" in first.stdout
    said = "Of 2 policies of walker, walker-ppo-tanh-256x256-1000 scores best"
    assert said in " ".join(first.stdout.split())
    page = (guide / "matching-study.md").read_text()
    assert "One more was trained, but does not walk by the rule of the plan" in page
    assert "pdtui train walker --algorithm ppo --activation tanh --layers 256,256 --seed 1001" in page
    data = read_study_data(folder / "matching-study.parquet")
    assert [one.walks for one in data.policies] == [True, False]
    assert {one.policy for one in data.measured} == {"walker-ppo-tanh-256x256-1000"}
    for one in data.measured:
        assert np.isfinite(one.effects).all()
        assert sum(one.roles == ROLES.index("reference")) == 12
        assert sum(one.roles == ROLES.index("random")) == 6
        assert (np.sort(one.ranks, axis=1)[:, :2] == [0, 1]).all()

    # What is measured so far can be analyzed before the rest is.
    (folder / "walker-ppo-tanh-256x256-1001.parquet").rename(tmp_path / "kept.parquet")
    so_far = _run(*options, "--so-far", "--json")
    assert [one["name"] for one in json.loads(so_far.stdout)["policies"]] == ["walker-ppo-tanh-256x256-1000"]
    (tmp_path / "kept.parquet").rename(folder / "walker-ppo-tanh-256x256-1001.parquet")

    # It goes on where it was, and the page is the same when it is drawn again from the data.
    parts = {path: path.stat().st_mtime_ns for path in folder.glob("walker*.parquet")}
    again = _run(*options, "--json")
    assert again.exit_code == 0, again.output
    assert {path: path.stat().st_mtime_ns for path in folder.glob("walker*.parquet")} == parts
    summary = json.loads(again.stdout)
    assert (summary["answer"], summary["wanted"], len(summary["policies"])) == ("unknown", 3, 2)
    walking, falling = summary["scores"]
    assert 0.0 <= walking["score"] == walking["walking"] * walking["steering"] <= 1.0
    assert (falling["policy"], falling["score"]) == ("walker-ppo-tanh-256x256-1001", 0.0)
    redrawn = _run("--data", folder / "matching-study.parquet", "--guide", tmp_path / "other")
    assert redrawn.exit_code == 0, redrawn.output
    assert (tmp_path / "other" / "matching-study.md").read_text() == page
    figure = "images/matching-study-hits.png"
    assert (tmp_path / "other" / figure).read_bytes() == (guide / figure).read_bytes()
    refused = _run("--data", folder / "matching-study.parquet", "--guide", guide)
    assert refused.exit_code == 1
    assert "already exists; --overwrite replaces it" in refused.stderr


def test_the_list_says_which_policies_are_trained(trained: Path, tmp_path: Path) -> None:
    listed = _run("--plan", trained / "plan.toml", "--policies", trained, "--list", "--json")
    assert [(one["policy"][-4:], one["trained"]) for one in json.loads(listed.stdout)] == [
        ("1000", True),
        ("1001", True),
        ("1002", False),
    ]
    nothing = _run("--plan", trained / "plan.toml", "--policies", tmp_path, "--folder", tmp_path)
    assert nothing.exit_code == 1
    assert "found none; begin with pdtui train walker --algorithm ppo" in nothing.stderr
