# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

import preview
import stage

SMALL = ["--size", "24", "--samples", "2"]


def size(path):
    return stage.read(path).shape[:2]


def test_a_glb_as_it_is_to_a_relative_path(glb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    preview.main([str(glb), "-o", "ball.png", *SMALL])
    assert size(tmp_path / "ball.png") == (24, 24)


def test_materials_are_rows_and_modes_columns_with_differences(manifest, tmp_path):
    picture = tmp_path / "rows.png"
    preview.main([str(manifest), "-o", str(picture), *SMALL, "--material", "nickel", "gold-paint",
                  "--mode", "fit", "lobes", "sun"])
    assert size(picture) == (2 * 24, 5 * 24)


def test_another_object_and_an_environment_file(manifest, glb, tmp_path):
    stage.clear()
    image, file = stage.studio(16), tmp_path / "sky.exr"
    image.file_format, image.filepath_raw = "OPEN_EXR", str(file)
    image.save()
    picture = tmp_path / "object.png"
    preview.main([str(manifest), "-o", str(picture), *SMALL, "--object", str(glb), "--environment", str(file)])
    assert size(picture) == (24, 24)


@pytest.mark.parametrize("name, made", [("turn.png", ["turn_0001.png", "turn_0002.png"]), ("turn.mp4", ["turn.mp4"])])
def test_turntable_frames_and_movie(manifest, tmp_path, name, made):
    preview.main([str(manifest), "-o", str(tmp_path / name), *SMALL, "--mode", "fit", "--turntable", "2"])
    assert sorted(path.name for path in tmp_path.iterdir()) == made


def test_the_modes_agree_under_a_sun(manifest, tmp_path):
    """Lobes and exact textures show the same bronze, the difference panel next to nothing."""
    picture = tmp_path / "same.png"
    preview.main([str(manifest), "-o", str(picture), "--size", "48", "--samples", "8", "--material", "alum-bronze",
                  "--mode", "lobes", "sun"])
    pixels = stage.read(picture)
    lobes, sun, difference = (pixels[:, i * 48:(i + 1) * 48, :3] for i in range(3))
    assert lobes.mean() > 0.2
    assert difference.mean() < 0.05 * lobes.mean()


@pytest.mark.parametrize("arguments, expected", [
    (["gone.glb", "-o", "x.png"], "gone.glb: no such file"),
    ([__file__, "-o", "x.png", "--environment", "gone.hdr"], "gone.hdr: no such file"),
    ([__file__, "-o", "x.png", "--samples", "0"], "not a positive number"),
])
def test_wrong_use(arguments, expected, capsys):
    with pytest.raises(SystemExit) as stopped:
        preview.main(arguments)
    assert stopped.value.code == 2
    assert expected in capsys.readouterr().err


def test_arguments_after_the_dashes_are_blenders_own_way():
    assert preview.own_arguments(["blender", "-b", "-P", "preview.py", "--", "a.glb"]) == ["a.glb"]
    assert preview.own_arguments(["preview.py", "a.glb"]) == ["a.glb"]
