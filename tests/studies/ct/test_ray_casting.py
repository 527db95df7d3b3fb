"""Rays through a scan: closed forms, sums by hand, another ray caster, and both orders of compositing."""

import numpy as np
import pytest

from palpate.bodies.ct.image import Image
from palpate.report import render
from palpate.studies.ct import figures, ray_casting
from palpate.studies.ct.ray_casting import AMBIENT, DIFFUSE, Transfer, cast, field_of, front, parallel_rays

ALONG_Y = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def grid(values, spacing=(0.002, 0.002, 0.003)) -> Image:
    return Image(np.asarray(values, dtype=np.float32), np.array([0.01, -0.02, 0.03]), np.array(spacing), "scan")


@pytest.fixture(scope="module")
def noise() -> Image:
    return grid(np.random.default_rng(1).normal(0, 400, (9, 12, 10)))


@pytest.fixture(scope="module")
def looks() -> Transfer:
    values = np.linspace(-1000, 1000, 101)
    random = np.random.default_rng(2)
    return Transfer(values, random.uniform(size=(101, 3)), random.uniform(0, 0.3, 101))


def test_light_fades_through_a_block_by_its_law():
    block = grid(np.full((5, 21, 7), 100.0))
    looks = Transfer(np.array([0.0, 200.0]), np.full((2, 3), 0.5), np.full(2, 0.05))
    rays = parallel_rays(block, ALONG_Y, 7, 0.5)
    found, samples = cast(field_of(block), looks, rays)
    inner = found.reshape(rays.height, rays.width, 4)[1:-1, 1:-1]
    assert samples.max() == 41  # each half voxel, both ends included
    assert inner[..., 3] == pytest.approx(1 - 0.95**41)  # steps of 1 mm
    assert inner[..., 0] == pytest.approx(inner[..., 3] * 0.5 * (AMBIENT + DIFFUSE))  # no gradient: facing the light


@pytest.mark.parametrize("axes", [ALONG_Y, front()], ids=["along an axis", "oblique"])
def test_both_orders_are_the_sum_of_what_each_sample_lets_through(noise, looks, axes):
    field, rays = field_of(noise), parallel_rays(noise, axes, 30, 0.4)
    forward, taken = cast(field, looks, rays)
    backward, all_of = cast(field, looks, rays, back_to_front=True)
    assert np.array_equal(taken, all_of) and taken.max() > 20
    assert np.abs(ray_casting.on_white(forward) - ray_casting.on_white(backward)).max() < 1e-12
    ray = int(taken.argmax())
    single = [
        cast(field, looks, rays._replace(starts=rays.starts[[ray]] + k * rays.step, counts=np.array([1])))[0][0]
        for k in range(taken[ray])
    ]
    through = np.cumprod([1.0] + [1 - one[3] for one in single])[:-1]
    assert forward[ray] == pytest.approx((through[:, None] * np.array(single)).sum(axis=0), abs=1e-12)


@pytest.mark.parametrize("enough", [0.9, 0.99])
def test_a_ray_that_ends_early_misses_no_more_than_it_says(noise, looks, enough):
    field, rays = field_of(noise), parallel_rays(noise, front(), 30, 0.4)
    whole, every = cast(field, looks, rays)
    early, taken = cast(field, looks, rays, enough=enough)
    assert taken.sum() < every.sum()
    assert 0 < np.abs(ray_casting.on_white(early) - ray_casting.on_white(whole)).max() <= 1 - enough


def test_opacity_hardly_depends_on_the_step(noise, looks):
    smooth = looks._replace(per_mm=np.linspace(0, 0.05, 101))
    pictures = [cast(field_of(noise), smooth, parallel_rays(noise, front(), 30, step))[0] for step in (0.4, 0.1)]
    assert np.abs(pictures[0][:, 3] - pictures[1][:, 3]).mean() < 0.02


def test_another_ray_caster_lets_as_much_light_through():
    """VTK's, of a black volume on white, so that shading does not matter."""
    from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
    from vtkmodules.vtkRenderingCore import vtkColorTransferFunction

    x, y, z = np.meshgrid(*(np.linspace(-1, 1, 31),) * 3, indexing="ij")
    image = grid(np.maximum(500 * (1 - x**2 - 2 * y**2 - z**2), 0), (0.002, 0.002, 0.002))
    looks = Transfer(np.array([0.0, 500.0]), np.zeros((2, 3)), np.array([0.0, 0.06]))
    rays = parallel_rays(image, ALONG_Y, 240, 0.5)
    ours = ray_casting.on_white(cast(field_of(image), looks, rays)[0]).reshape(rays.height, rays.width, 3)[..., 0]

    colours, opacities = vtkColorTransferFunction(), vtkPiecewiseFunction()
    colours.AddRGBPoint(0, 0, 0, 0)
    opacities.AddPoint(0, 0.0)
    opacities.AddPoint(500, 0.06)
    volume = figures._volume(image, np.zeros(image.hu.shape, dtype=bool))
    volume.GetProperty().SetColor(colours)
    volume.GetProperty().SetScalarOpacity(opacities)
    volume.GetProperty().ShadeOff()
    middle = image.to_world(np.array([15, 15, 15]))
    with render.Stage(240, 240) as stage:
        theirs = stage.picture(render.View(ALONG_Y, middle, 0.06, 0.06), [lambda s: s.volume(volume)])[..., 0] / 255
    assert ours.min() < 0.4 and np.abs(ours - theirs).mean() < 0.01
    assert np.abs(ours - theirs)[110:130, 110:130].max() < 0.01
