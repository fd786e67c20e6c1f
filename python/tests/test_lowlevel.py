"""The parts by the array: against closed forms, and a small integrator against the large one."""

import numpy as np
import pytest
from conftest import SCENES

import steradian as sr


def sphere() -> sr.Scene:
    return sr.Scene(shapes=[sr.Sphere(1.0, material=sr.DiffuseMaterial(0.5))], lights=[sr.InfiniteConstantLight(1.0)])


def test_rays_meet_a_sphere_where_they_should() -> None:
    rng = np.random.default_rng(1)
    n = 10_000
    origins = np.repeat([[0.0, 0.0, -3.0]], n, axis=0)
    directions = np.column_stack([rng.uniform(-0.6, 0.6, (n, 2)), np.ones(n)])
    scene = sphere()
    hits = scene.intersect(origins, directions)
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    b = unit @ [0, 0, -3.0]
    inside = b**2 - 8
    clear = np.abs(inside) > 1e-4
    assert (hits.valid == (inside > 0))[clear].all()
    # The sphere's outline has the tangent 1/√8, the window a side of 1.2.
    assert hits.valid.mean() == pytest.approx(np.pi / 8 / 1.2**2, abs=0.02)
    expected = -b - np.sqrt(np.maximum(inside, 0))
    assert np.abs(hits.t - expected)[hits.valid & clear].max() < 1e-3
    assert (scene.occluded(origins, directions) == hits.valid).all()
    assert not scene.occluded(origins, directions, t_max=1.5).any()
    assert (scene.intersect(origins, directions, threads=1).t == hits.t).all()


def test_odd_rays_hit_nothing_and_odd_arrays_are_refused() -> None:
    scene = sphere()
    bad = np.array([[np.nan, 0, 0], [0, 0, 0], [np.inf, 0, 0]], np.float32)
    assert not scene.intersect(np.zeros((3, 3)), bad).valid.any()
    assert not scene.intersect(bad + [[0, 0, 0], [np.nan, 0, 0], [0, 0, 0]], np.eye(3)).valid.any()
    for origins, directions in [(np.zeros((2, 3)), np.zeros((3, 3))), (np.zeros((3, 2)), np.zeros((3, 2)))]:
        with pytest.raises(ValueError):
            scene.intersect(origins, directions)
    assert len(scene.intersect(np.zeros((0, 3)), np.zeros((0, 3))).t) == 0


def test_a_bsdf_integrates_to_its_albedo_and_samples_its_density() -> None:
    up = np.array([[0.3, 0.1, 0.9]])
    up /= np.linalg.norm(up)
    for material, least, most in [
        (sr.DiffuseMaterial(0.5), 0.499, 0.501),
        # A width of √0.0625 = 0.25: GGX gives back 0.916 at the normal and 0.857 at 60 degrees of what its facets reflect.
        (sr.ConductorMaterial((0.9, 0.9, 0.9), roughness=0.0625), 0.79, 0.84),
    ]:
        bsdf = sr.Bsdf(material)

        def reflected(u: np.ndarray, bsdf: sr.Bsdf = bsdf) -> np.ndarray:
            wi = sr.warp.cosine_hemisphere(u)
            return bsdf.eval(wi, np.repeat(up, len(wi), axis=0)) * np.pi

        e = sr.estimate(reflected, "sobol", 1 << 16)
        assert (least - 0.005 < e.mean).all() and (e.mean < most + 0.005).all()
        samples = bsdf.sample(sr.Sampler("sobol").points(4096, 3), np.repeat(up, 4096, axis=0))
        assert samples.weight.mean() == pytest.approx(e.mean.mean(), abs=0.01)
        drawn = samples.pdf > 0
        again = bsdf.pdf(samples.wi[drawn], np.repeat(up, drawn.sum(), axis=0))
        assert np.allclose(again, samples.pdf[drawn], rtol=2e-2)
    mirror = sr.Bsdf(sr.ConductorMaterial("Ag")).sample([[0.5, 0.5, 0.5]])
    assert mirror.delta[0] and np.allclose(mirror.wi, [[0, 0, 1]], atol=1e-6)


@pytest.mark.parametrize("name", sr.warp._names)
def test_warps_have_inverses_and_densities(name: str) -> None:
    u = sr.Sampler("sobol").points(1024, 2)
    x = getattr(sr.warp, name)(u)
    assert np.abs(getattr(sr.warp, f"{name}_inverse")(x) - u).max() < 2e-3
    # The mean of 1 / pdf is the size of the target.
    size = {"concentric_disk": np.pi, "uniform_hemisphere": 2 * np.pi}.get(name, 4 * np.pi)
    if name != "cosine_hemisphere":
        assert (1 / getattr(sr.warp, f"{name}_pdf")(x)).mean() == pytest.approx(size, rel=1e-3)
    with pytest.raises(AttributeError, match="there is no warp"):
        sr.warp.square


def test_samplers_extend_and_are_stratified() -> None:
    sobol = sr.Sampler("sobol", seed=3)
    points = sobol.points(256, 5)
    assert points.shape == (256, 5) and points.min() >= 0 and points.max() < 1
    assert (sobol.points(128, 5, begin=128) == points[128:]).all()
    assert len(np.unique((points[:, :2] * 16).astype(int) @ [16, 1])) == 256
    assert (sobol.points(4, 2) != sobol.replace(seed=4).points(4, 2)).any()
    with pytest.raises(sr.ParameterError, match="cannot be `sobl`"):
        sr.Sampler("sobl").points(1, 1)


def test_estimates_know_their_error() -> None:
    for kind in ["sobol", "independent", "stratified"]:
        e = sr.estimate(lambda u: np.exp(u.sum(axis=1)), kind, 4096, dimensions=3)
        exact = (np.e - 1) ** 3
        assert abs(e.mean - exact) < 5 * e.standard_error
    with pytest.raises(sr.ParameterError):
        sr.estimate(lambda u: u, "sobol", 3)


def test_a_small_integrator_agrees_with_the_large_one() -> None:
    scene = sr.load(SCENES / "small-lamp.pbrt")
    reference = sr.render(scene, integrator="direct", spp=256)
    height, width, _ = reference.shape
    y, x = np.mgrid[0:height, 0:width]
    total = np.zeros((height * width, 3))
    sampler = sr.Sampler("independent", seed=7)
    n = 64
    for i in range(n):
        u = sampler.points(height * width, 5, begin=i * height * width)
        origins, directions = scene.camera_rays(np.column_stack([x.ravel(), y.ravel()]) + u[:, :2])
        points = scene.surfaces(origins, directions)
        light = points.sample_lights(u[:, 2:])
        cosine = np.abs((light.wi * points.n).sum(axis=1))
        with np.errstate(divide="ignore", invalid="ignore"):
            weight = np.where(light.visible & (light.pdf > 0), cosine / light.pdf, 0.0)
        total += points.emitted + points.eval(light.wi) * light.li * weight[:, None]
        total[~points.valid] += scene.background(directions[~points.valid])
    own = (total / n).reshape(height, width, 3)
    # Away from the lamp, which edges make noisy.
    calm = reference.array.max(axis=2) < 5
    assert own[calm].mean() == pytest.approx(reference.array[calm].mean(), rel=0.02)
