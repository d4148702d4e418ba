"""The page of the guide about the matching study is what the shipped data say."""

from __future__ import annotations

from pdtui.guide.guide_pages import GUIDE_FOLDER
from pdtui.study.matching.matching_study_plan import load_matching_study_plan
from pdtui.study.matching.study_data import SHIPPED_STUDY_DATA, read_study_data
from pdtui.study.matching.study_page import compose_study_page, page_files
from pdtui.study.matching.study_statistics import analyze_study


def test_the_page_is_written_from_the_shipped_data() -> None:
    data = read_study_data(SHIPPED_STUDY_DATA)
    page, *figures = page_files(GUIDE_FOLDER)
    assert page.read_text(encoding="utf-8") == compose_study_page(data, analyze_study(data))
    assert all(figure.stat().st_size > 10_000 for figure in figures)


def test_the_shipped_data_follow_the_plan_and_are_small() -> None:
    assert read_study_data(SHIPPED_STUDY_DATA).plan == load_matching_study_plan()
    assert SHIPPED_STUDY_DATA.stat().st_size < 5_000_000
