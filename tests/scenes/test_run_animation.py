"""Films of runs: which states they show, where they are written, and what is refused before a frame is drawn."""

import matplotlib
import numpy as np
import pytest

import pycraft as pc

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402 - after the backend is chosen


@pytest.fixture(autouse=True)
def close():
    pyplot.close("all")  # those of other tests
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def run():
    return pc.mechanisms.double_pendulum().simulate(0.4)


def bones(film):
    """Ends of the bones in the plane of the picture."""
    return np.array(film._stick._lines["bone"].artist.get_segments())


def test_frames_are_states_of_the_run(run):
    film = run.animate(fps=20, speed=0.5)
    assert film.times == pytest.approx(np.arange(17) * 0.025) and repr(film) == "<animation of 'double pendulum': 17 frames, 0 to 0.4 s>"
    for frame in (0, 7, 16):
        film._show(frame)
        q = run.at(film.times[frame]).q
        elbow = run.model.pose("lower", q)[[0, 2], 3]
        assert bones(film)[0] == pytest.approx(np.array([[0, 0], elbow]), abs=1e-12)
        assert film._stick.ax.get_title() == f"double pendulum, t = {film.times[frame]:.2f} s"
    assert pyplot.get_fignums() == []  # a notebook would show it twice


def test_every_frame_is_in_view():
    """A cart that runs away: the axes are those of its whole way."""
    scene = pc.mechanisms.cart_pole()
    run = scene.simulate(2.0, v=[5.0, 0.0], q=[0.0, 0.1])
    ax = run.animate().figure.axes[0]
    low, high = ax.get_xlim()
    assert low < run.q[:, 0].min() and high > run.q[:, 0].max() + 0.1


def test_a_trace_goes_as_far_as_the_film(run):
    film = run.animate(trace="lower", view="xz", names=True)
    way = film._way.artist
    film._show(6)
    ends = np.array(way.get_segments())
    places = run.model.pose("lower", run.at(film.times[:7]).q)[:, :3, 3][:, [0, 2]]
    assert ends[:, 0] == pytest.approx(places[:-1], abs=1e-12) and ends[:, 1] == pytest.approx(places[1:], abs=1e-12)
    film._show(0)
    assert len(way.get_segments()) == 0
    with pytest.raises(pc.ModelError, match="hand"):
        run.animate(trace="hand")


def test_a_page_and_a_gif(run, tmp_path):
    from PIL import Image

    film = run.animate(tmp_path / "run.gif", fps=10)
    with Image.open(tmp_path / "run.gif") as picture:
        assert picture.n_frames == len(film.times) == 5 and picture.info["duration"] == 100
    page = film.save(tmp_path / "run.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>") and page.count("data:image/png;base64") >= 5
    assert film._repr_html_() in page


def test_a_run_without_steps_shows_the_last_state_asked_for():
    run = pc.mechanisms.pendulum().simulate(1.0, t_eval=[0.0, 0.35, 1.0], dense=False)
    film = run.animate(fps=10)
    assert film._q[:, 0].tolist() == run.q[[0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 2], 0].tolist()


def test_a_run_from_a_file(run, tmp_path):
    run.save(tmp_path / "run.nc")
    again = pc.load_run(tmp_path / "run.nc").animate(fps=10)
    assert again._q == pytest.approx(run.animate(fps=10)._q, abs=1e-8)


def test_in_axes_of_ones_own(run):
    figure, axes = pyplot.subplots(1, 2)
    film = run.animate(ax=axes[1], view="xz")
    assert film.figure is figure and pyplot.get_fignums() != []


@pytest.mark.parametrize(
    "options, error, text",
    [
        (dict(fps=0), pc.EvaluationError, "fps=0: give a positive number"),
        (dict(speed=-1.0), pc.EvaluationError, "speed=-1: give a positive number"),
        (
            dict(speed=1e-3),
            pc.EvaluationError,
            r"at fps=25 and speed=0\.001 are 10001 frames; at most 2000 can be drawn; use speed=0\.005 or",
        ),
        (dict(view="front"), pc.EvaluationError, "view='front': there are 'auto'"),
        (dict(output="run.avi"), pc.EvaluationError, r"output 'run.avi': a film is written to a file that ends in \.html, \.gif, \.mp4"),
    ],
)
def test_what_makes_no_sense(run, options, error, text):
    with pytest.raises(error, match=text):
        run.animate(**options)


def test_outputs_are_looked_at_before_a_frame_is_drawn(run, tmp_path, monkeypatch):
    monkeypatch.setattr("pycraft.scenes.run_animation.RunAnimation.__init__", lambda *_: pytest.fail("drawn"))
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        run.animate(tmp_path / "none" / "run.gif")
    monkeypatch.setattr("matplotlib.animation.FFMpegWriter.isAvailable", lambda: False)
    with pytest.raises(pc.EvaluationError, match=r"'\.mp4' needs ffmpeg, which is not installed; '\.html' and '\.gif' need nothing"):
        run.animate(tmp_path / "run.mp4")
    assert list(tmp_path.iterdir()) == []
