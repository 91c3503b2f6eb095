"""The Earth against published constants, an extended-precision zonal series, JSBSim and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim import earth
from sinssim.earth import ELLIPSOIDS, GRAVITY_MODELS, WGS84, Ellipsoid
from sinssim.errors import InputError
from tests.oracles import gravity as oracle

near = earth.near_gravity_k

LATITUDES = np.deg2rad([-90, -89.999, -67.3, -45, -12.5, -1e-7, 0, 1e-7, 8.25, 30, 45, 60, 89.5, 90])
HEIGHTS = np.array([-430.0, 0.0, 100.0, 9000.0, 30e3, 100e3, 2e6, 2e7])


def exact_ecef(latitude, longitude, height):
    """Earth-fixed coordinates in extended precision."""
    rho, z = oracle.WGS84.meridian_point(latitude, height)
    longitude = np.asarray(longitude, np.longdouble)
    return np.stack(np.broadcast_arrays(rho * np.cos(longitude), rho * np.sin(longitude), z), axis=-1)


def c_en(latitude, longitude):
    sb, cb, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    return np.array([[-sb * cl, -sl, -cb * cl], [-sb * sl, cl, -cb * sl], [cb, 0.0, -sb]])


# --- constants ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("quantity", "published", "digit"),
    [  # NIMA TR8350.2 (2000), tables 3.1 to 3.4; the last column is one unit of the last printed digit
        ("b", 6356752.3142, 1e-4),
        ("e2", 6.69437999014e-3, 1e-14),
        ("linear_eccentricity", 5.2185400842339e5, 1e-8),
        ("m", 0.00344978650684, 1e-14),
        ("gamma_e", 9.7803253359, 1e-10),
        ("gamma_p", 9.8321849378, 1e-10),
        ("k", 0.00193185265241, 5e-14),  # printed five units low: the exact value is 0.001931852652458
        ("j2", 0.484166774985e-3 * math.sqrt(5), 3e-15),
    ],
)
def test_derived_constants_of_wgs84(quantity, published, digit):
    assert getattr(WGS84, quantity) == pytest.approx(published, abs=digit, rel=0)


def test_derived_constants_against_extended_precision():
    field, zero = oracle.WGS84, np.zeros(1, np.longdouble)
    gamma_e = -field.gravity(np.array([field.a]), zero)[0][0]
    gamma_p = -field.gravity(zero, np.array([field.b]))[1][0]
    assert WGS84.gamma_e == pytest.approx(float(gamma_e), rel=3e-16)
    assert WGS84.gamma_p == pytest.approx(float(gamma_p), rel=3e-16)
    assert WGS84.j2 == pytest.approx(float(field.j2), rel=1e-14)
    k = field.b * gamma_p / (field.a * gamma_e) - 1
    assert WGS84.k == pytest.approx(float(k), abs=3e-16)  # one ulp of the 1 that is taken off


def test_mean_normal_gravity_over_the_ellipsoid():
    x, weight = np.polynomial.legendre.leggauss(40)
    latitude = x * np.pi / 2
    r1, r2 = earth.radii(latitude)
    area = weight * r1 * r2 * np.cos(latitude)
    assert area @ earth.surface_gravity(latitude) / area.sum() == pytest.approx(9.7976432222, abs=1e-10)


@pytest.mark.parametrize(
    ("name", "a", "inverse_f"),
    [
        ("wgs84", 6378137.0, 298.257223563),
        ("krasovsky-1940", 6378245.0, 298.3),
        ("international-1924", 6378388.0, 297.0),
        ("pz-90.11", 6378136.0, 298.25784),
    ],
)
def test_ellipsoids_by_name(name, a, inverse_f):
    ellipsoid = earth.ellipsoid_by_name(name)
    assert ellipsoid is ELLIPSOIDS[name]
    assert ellipsoid.name == name
    assert ellipsoid.a == a
    assert 1 / ellipsoid.f == pytest.approx(inverse_f, rel=1e-15)


def test_unknown_names_are_answered_with_the_list():
    with pytest.raises(InputError, match=r"wgs-84.*wgs84.*krasovsky-1940"):
        earth.ellipsoid_by_name("wgs-84")
    with pytest.raises(InputError, match=r"nromal.*normal.*somigliana"):
        earth.gravity_ned(0.5, 0.0, "nromal")
    with pytest.raises(InputError, match="J2"):
        earth.gravitation_ecef([7e6, 0, 0], "J2")


def test_gravity_of_the_other_ellipsoids():
    latitude = np.deg2rad(np.arange(-90, 91, 15.0))
    s2, s22 = np.sin(latitude) ** 2, np.sin(2 * latitude) ** 2
    # International gravity formula of 1930 (Cassinis), whose coefficients are printed to 5e-8 and 5e-8
    cassinis = 9.78049 * (1 + 0.0052884 * s2 - 0.0000059 * s22)
    international = earth.surface_gravity(latitude, ELLIPSOIDS["international-1924"])
    np.testing.assert_allclose(international, cassinis, atol=1.0e-6, rtol=0)
    # Helmert 1901-1909 belongs to f = 1/298.2, Krasovsky's is 1/298.3: 1.1e-6 of relative pole gravity apart,
    # and its coefficients are printed to 5e-7
    helmert = 9.78030 * (1 + 0.005302 * s2 - 0.000007 * s22)
    np.testing.assert_allclose(
        earth.surface_gravity(latitude, ELLIPSOIDS["krasovsky-1940"]), helmert, atol=2.0e-5, rtol=0
    )
    # PZ-90.11 (Ministry of Defence of the Russian Federation, 2014): γ_e = 978032.84 mGal
    assert ELLIPSOIDS["pz-90.11"].gamma_e == pytest.approx(9.7803284, abs=1e-7)


# --- radii and coordinates ----------------------------------------------------------------------------------


def test_radii_at_the_equator_and_the_pole():
    r1, r2 = earth.radii(np.array([0.0, np.pi / 2]))
    polar = 6399593.6258  # TR8350.2, table 3.3: radius of curvature at the pole c
    assert r1 == pytest.approx([6378137.0 * (1 - 6.69437999014e-3), polar], abs=1e-4)
    assert r2 == pytest.approx([6378137.0, polar], abs=1e-4)


def test_radii_are_the_curvature_of_the_ellipse():
    """R₁ = |d(ρ, z)/dB| and R₂ = ρ/cos B, from the curve in extended precision."""
    latitude = np.deg2rad(np.linspace(-85, 85, 35))
    step = np.longdouble(1e-4)
    points = {
        k: np.array(oracle.WGS84.meridian_point(np.longdouble(1) * latitude + k * step, 0)) for k in (-2, -1, 1, 2)
    }
    slope = (8 * (points[1] - points[-1]) - (points[2] - points[-2])) / (12 * step)  # error R·step⁴/30 = 2e-11 m
    rho, _ = oracle.WGS84.meridian_point(latitude, 0)
    r1, r2 = earth.radii(latitude)
    np.testing.assert_allclose(r1, np.float64(np.hypot(*slope)), rtol=1e-14)
    np.testing.assert_allclose(r2, np.float64(rho / np.cos(latitude)), rtol=1e-14)


def test_published_conversions():
    # Ordnance Survey, A guide to coordinate systems in Great Britain, annex B (Airy 1830 ellipsoid)
    airy = Ellipsoid("airy-1830", 6377563.396, (6377563.396 - 6356256.909) / 6377563.396, 3.986004418e14)
    latitude = np.deg2rad(52 + 39 / 60 + 27.2531 / 3600)
    longitude = np.deg2rad(1 + 43 / 60 + 4.5177 / 3600)
    published = [3874938.849, 116218.624, 5047168.208]
    np.testing.assert_allclose(earth.geodetic_to_ecef(latitude, longitude, 24.7, airy), published, atol=1.5e-3, rtol=0)
    lat, lon, h = earth.ecef_to_geodetic(published, airy)
    assert (lat, lon) == pytest.approx((latitude, longitude), abs=2e-10)
    assert h == pytest.approx(24.7, abs=1.5e-3)
    # the reference point of pymap3d's tests: 42° N 82° W 200 m on WGS-84
    published = [660675.2518247, -4700948.68316, 4245737.66222]
    np.testing.assert_allclose(
        earth.geodetic_to_ecef(np.deg2rad(42), np.deg2rad(-82), 200.0), published, atol=1e-5, rtol=0
    )


@pytest.mark.parametrize("height", HEIGHTS)
@pytest.mark.parametrize("longitude", np.deg2rad([0.0, 37.6, 90.0, 179.999999, -179.999999, -90.0]))
def test_geodetic_and_earth_fixed_coordinates(height, longitude):
    exact = exact_ecef(LATITUDES, longitude, height)
    radius = 6.4e6 + height
    np.testing.assert_allclose(
        earth.geodetic_to_ecef(LATITUDES, longitude, height), np.float64(exact), atol=4e-16 * radius, rtol=0
    )
    lat, lon, h = earth.ecef_to_geodetic(np.float64(exact))
    # the input itself is rounded to 1 ulp (≤ 3.7e-9 m at 26 400 km): that much must come back, in metres
    bar = 4e-16 * radius
    assert np.max(np.abs(lat - LATITUDES)) * radius < bar
    assert np.max(np.abs(h - height)) < bar
    east = (lon - longitude) * radius * np.cos(LATITUDES)
    assert np.max(np.abs(east)) < bar


def test_poles_and_antimeridian():
    lat, lon, h = earth.ecef_to_geodetic([[0, 0, 6356752.314245179], [0, 0, -6356752.314245179 - 1000]])
    assert lat == pytest.approx([np.pi / 2, -np.pi / 2], abs=0)
    np.testing.assert_array_equal(lon, [0, 0])
    np.testing.assert_allclose(h, [0, 1000], atol=2e-9, rtol=0)
    _, lon, _ = earth.ecef_to_geodetic([[-6378137.0, 0.0, 0.0], [-6378137.0, -1e-3, 0.0]])
    assert lon[0] == np.pi  # (−π, π]: the antimeridian is +180°
    assert lon[1] == pytest.approx(-np.pi + 1e-3 / 6378137)


@pytest.mark.parametrize("r", [[0.0, 0.0, 0.0], [1e5, -1e5, 9e5], [np.nan, 6e6, 0.0]])
def test_positions_without_a_latitude_are_refused(r):
    with pytest.raises(InputError, match=r"row 1.*Earth's centre"):
        earth.ecef_to_geodetic([[7e6, 0, 0], r])
    with pytest.raises(InputError, match="3 components"):
        earth.ecef_to_geodetic([1.0, 2.0])


def test_ned_axes_are_the_directions_of_latitude_longitude_and_height():
    latitude = np.deg2rad([-89.0, -30.0, 0.0, 1e-6, 55.0, 89.9])
    longitude = np.deg2rad([10.0, -170.0, 0.0, 90.0, 180.0, -45.0])
    step = np.longdouble(1e-5)
    columns = []
    for d_lat, d_lon, d_h in ((step, 0, 0), (0, step, 0), (0, 0, -step * 6378137)):
        ahead = exact_ecef(np.longdouble(1) * latitude + d_lat, np.longdouble(1) * longitude + d_lon, d_h)
        behind = exact_ecef(np.longdouble(1) * latitude - d_lat, np.longdouble(1) * longitude - d_lon, -d_h)
        difference = ahead - behind
        columns.append(np.float64(difference / np.linalg.norm(np.float64(difference), axis=-1)[:, None]))
    q0, q1, q2, q3 = earth.q_en(latitude, longitude).T
    axes = [
        (1 - 2 * (q2 * q2 + q3 * q3), 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)),
        (2 * (q1 * q2 - q0 * q3), 1 - 2 * (q1 * q1 + q3 * q3), 2 * (q2 * q3 + q0 * q1)),
        (2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), 1 - 2 * (q1 * q1 + q2 * q2)),
    ]
    for expected, axis in zip(columns, axes, strict=True):
        np.testing.assert_allclose(np.stack(axis, axis=-1), expected, atol=1e-9, rtol=0)  # step²/6, and R/R₁ at 89.9°


def test_inertial_frame_turns_under_the_earth():
    r_e = np.array([4.2e6, 1.1e6, 4.6e6])
    np.testing.assert_array_equal(earth.ecef_to_eci(r_e, 0.0), r_e)
    quarter = np.pi / 2 / 7.292115e-5  # after a quarter of a turn, e's x axis points along i's y axis
    np.testing.assert_allclose(earth.ecef_to_eci([1.0, 0, 0], quarter), [0, 1, 0], atol=1e-15, rtol=0)
    np.testing.assert_allclose(earth.eci_to_ecef([0, 1.0, 0], quarter), [1, 0, 0], atol=1e-15, rtol=0)
    velocity = (earth.ecef_to_eci(r_e, 1001.0) - earth.ecef_to_eci(r_e, 999.0)) / 2
    expected = np.cross([0, 0, 7.292115e-5], earth.ecef_to_eci(r_e, 1000.0))
    np.testing.assert_allclose(velocity, expected, atol=1e-6, rtol=0)  # ω³r/6 = 4e-7
    assert earth.ecef_to_eci(np.tile(r_e, (5, 1)), np.arange(5.0)).shape == (5, 3)
    slow = Ellipsoid("slow", 6378137.0, 1 / 298.0, 3.986e14, omega=1e-5)
    np.testing.assert_allclose(earth.ecef_to_eci([1.0, 0, 0], 100.0, slow), [np.cos(1e-3), np.sin(1e-3), 0], rtol=1e-15)


# --- gravity ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("height", HEIGHTS)
def test_normal_gravity_is_the_zonal_series(height):
    north, down = oracle.WGS84.north_down(LATITUDES, np.full(len(LATITUDES), height))
    g = earth.gravity_ned(LATITUDES, height)
    # a few ulps of 9.8 m/s²
    np.testing.assert_allclose(g[:, 0], north, atol=5e-15, rtol=0)
    np.testing.assert_array_equal(g[:, 1], 0.0)
    np.testing.assert_allclose(g[:, 2], down, atol=1.5e-14, rtol=0)


@pytest.mark.parametrize("name", ELLIPSOIDS)
def test_normal_gravity_of_every_ellipsoid(name):
    e = ELLIPSOIDS[name]
    field = oracle.NormalField(e.a, 1 / e.f, e.gm, e.omega)
    north, down = field.north_down(LATITUDES, np.full(len(LATITUDES), 12e3))
    g = earth.gravity_ned(LATITUDES, 12e3, "normal", e)
    np.testing.assert_allclose(g, np.stack([north, 0 * north, down], axis=-1), atol=3e-14, rtol=0)
    assert e.j2 == pytest.approx(float(field.j2), rel=1e-13)


@pytest.mark.parametrize("name", ELLIPSOIDS)
def test_normal_gravity_near_the_ground_is_the_zonal_series_to_an_ulp(name):
    """There it is computed by polynomials, fitted to the closed form and better rounded than it."""
    e = ELLIPSOIDS[name]
    field = oracle.NormalField(e.a, 1 / e.f, e.gm, e.omega)
    rng = np.random.default_rng(8)
    latitude = np.concatenate([np.arcsin(rng.uniform(-1, 1, 4000)), [-np.pi / 2, -1e-9, 0.0, np.pi / 2]])
    height = np.concatenate([rng.uniform(-1e3, 30e3, 4000), [-999.0, 0.0, 29.999e3, 0.0]])
    north, down = field.north_down(latitude, height)
    p = earth.parameters(e)
    g = np.array([near(p, np.sin(b), np.cos(b), h) for b, h in zip(latitude, height, strict=True)])
    np.testing.assert_allclose(g[:, 0], north, atol=3e-15, rtol=0)
    np.testing.assert_allclose(g[:, 1], down, atol=1e-14, rtol=0)  # 1e-15 of gravity
    assert np.sqrt(np.mean((g[:, 1] - down) ** 2)) < 3e-15
    np.testing.assert_array_equal(g, earth.gravity_ned(latitude, height, "normal", e)[:, ::2])


def test_normal_gravity_at_the_surface_is_somiglianas():
    g_e, g_p = 9.7803253359, 9.8321849378  # TR8350.2
    a, b = 6378137.0, 6356752.3142
    s2, c2 = np.sin(LATITUDES) ** 2, np.cos(LATITUDES) ** 2
    expected = (a * g_e * c2 + b * g_p * s2) / np.sqrt(a * a * c2 + b * b * s2)
    for model in ("normal", "somigliana"):
        np.testing.assert_allclose(earth.gravity_ned(LATITUDES, 0.0, model)[:, 2], expected, atol=1.1e-10, rtol=0)


def test_somigliana_with_the_linear_height_term():
    g = earth.gravity_ned(LATITUDES[:, None], HEIGHTS[:5], "somigliana")
    surface = earth.surface_gravity(LATITUDES)
    np.testing.assert_allclose(g[..., 2], surface[:, None] * (1 - 2 * HEIGHTS[:5] / 6378137.0), rtol=1e-15)
    np.testing.assert_array_equal(g[..., :2], 0.0)


def test_j2_gravity_is_the_gradient_of_its_potential():
    gm, a, j2 = 3.986004418e14, 6378137.0, 1.082629821313e-3

    def potential(r):
        radius = np.sqrt(np.sum(r * r, axis=-1))
        p2 = (3 * (r[..., 2] / radius) ** 2 - 1) / 2
        return gm / radius * (1 - j2 * (a / radius) ** 2 * p2)

    r = np.float64(exact_ecef(LATITUDES, 0.7, 8000.0))
    gradient = np.empty_like(r)
    for axis in range(3):
        h = np.zeros(3, np.longdouble)
        h[axis] = 100.0
        near, wide = (potential(r + k * h) - potential(r - k * h) for k in (1, 2))
        gradient[:, axis] = (8 * near - wide) / 1200
    np.testing.assert_allclose(earth.gravitation_ecef(r, "j2"), gradient, atol=2e-11, rtol=0)


def test_j2_gravity_is_jsbsims(tmp_path, monkeypatch, capfd):
    jsbsim = pytest.importorskip("jsbsim")
    monkeypatch.chdir(tmp_path)
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.load_model("ball")
    for latitude, height in ((0, 10), (45, 3000), (60, 10000), (-30, 500), (89.9, 20000)):
        fdm["ic/lat-geod-deg"] = latitude
        fdm["ic/long-gc-deg"] = 30.0
        fdm["ic/h-sl-ft"] = height / 0.3048
        fdm.run_ic()
        r = np.array([fdm[f"position/ecef-{axis}-ft"] for axis in "xyz"]) * 0.3048
        g = np.linalg.norm(earth.gravitation_ecef(r, "j2"))
        # JSBSim's GM is rounded to 12 digits of ft³/s², its J2 to nine
        assert g == pytest.approx(fdm["accelerations/gravity-ft_sec2"] * 0.3048, rel=5e-11)
    capfd.readouterr()


def test_how_far_the_gravity_models_lie_from_the_exact_one():
    """Bounds that the theory of each approximation gives, up to 20 km; a smaller bound would be wrong too."""
    latitude, height = np.deg2rad(np.linspace(-90, 90, 181))[:, None], np.array([0.0, 5e3, 12e3, 20e3])
    exact = earth.gravity_ned(latitude, height)
    assert set(GRAVITY_MODELS) == {"normal", "j2", "somigliana", "order-1e-5", "order-1e-4", "order-1e-2"}
    worst = {}
    for model in GRAVITY_MODELS:
        difference = np.abs(earth.gravity_ned(latitude, height, model) - exact)
        worst[model] = (difference[..., 0].max(), difference[..., 2].max())
    # J2: the missing J4 = −2.37e-6, ~5 J4 g down and half of that north
    assert worst["j2"] == pytest.approx((6.2e-5, 1.18e-4), rel=0.02)
    # the linear height term neglects 3(h/a)² g = 2.9e-4 and 2(f + m)h/a g less its centrifugal half
    assert 5e-5 < worst["somigliana"][1] < 5e-4
    assert worst["order-1e-5"][0] < 1e-6
    assert 1e-7 < worst["order-1e-5"][1] < 4e-6
    assert 1e-4 < worst["order-1e-4"][1] < 1e-3
    assert 5.0e-2 < worst["order-1e-2"][1] < 5.4e-2
    # what is missing northward is the tilt of the vertical with height, β·g·2h/a… = 8.1e-9·h sin 2B
    for model in ("somigliana", "order-1e-4", "order-1e-2"):
        assert worst[model][0] == pytest.approx(8.1e-9 * 20e3, rel=0.02)


@pytest.mark.parametrize(
    ("model", "to_20_km", "at_100_km"),
    [("order-1e-5", 2.0e-7, 1.6e-5), ("order-1e-4", 3.2e-5, 5.5e-4), ("order-1e-2", 5.3e-3, 6.0e-3)],
)
def test_orders_of_the_chapters_series_to_100_km(model, to_20_km, at_100_km):
    """Largest error over all latitudes, relative to the field of the oracle: two digits, as the help states them."""
    latitude = np.deg2rad(np.linspace(-90.0, 90.0, 181))[:, None]
    errors = {}
    for name, heights in (("low", np.linspace(0.0, 20e3, 21)), ("high", np.array([100e3]))):
        north, down = oracle.WGS84.north_down(*np.broadcast_arrays(latitude, heights))
        got = earth.gravity_ned(latitude, heights, model)
        errors[name] = float((np.hypot(got[..., 0] - north, got[..., 2] - down) / np.hypot(north, down)).max())
    assert errors["low"] == pytest.approx(to_20_km, rel=0.02)
    assert errors["high"] == pytest.approx(at_100_km, rel=0.02)


@pytest.mark.parametrize(
    ("model", "series"),
    [
        ("order-1e-5", lambda x: 1.0 - 2.0 * x + 3.0 * x * x),
        ("order-1e-4", lambda x: 1.0 - 2.0 * x),
        ("order-1e-2", lambda x: 1.0 - 2.0 * x),
    ],
)
def test_series_over_a_sphere_at_rest(model, series):
    """Gravity of a sphere is GM/(a + H)²: of it the series leave out 4x³, 3x² and 3x², x = H/a, and what follows."""
    sphere = Ellipsoid("sphere", 6378137.0, 1e-9, 3.986004418e14, 1e-9)
    for height in (1e3, 20e3, 100e3):
        x = height / sphere.a
        got = earth.gravity_ned(0.7, height, model, sphere)[2] * sphere.a**2 / sphere.gm
        assert got == pytest.approx(series(x), abs=1e-8)
        left = (1.0 + x) ** -2 - got
        expected = -4.0 * x**3 + 5.0 * x**4 if model == "order-1e-5" else 3.0 * x**2 - 4.0 * x**3
        assert left == pytest.approx(expected, rel=1e-3, abs=1e-8)


def test_the_chapters_printed_rate_and_q_disagree():
    chapter = earth.ELLIPSOIDS["chapter"]
    of_rate = chapter.omega**2 * chapter.a / 9.78049
    assert of_rate == pytest.approx(0.0034468, abs=5e-8)
    assert of_rate / chapter.q - 1.0 == pytest.approx(-0.0060, abs=5e-5)
    assert math.sqrt(chapter.q * 9.78049 / chapter.a) == pytest.approx(7.292e-5, rel=1e-4)


def test_chapter_formulas_with_their_own_constants():
    """The three series of the chapter, written out here from Clairaut's constants, on the International ellipsoid."""
    e = ELLIPSOIDS["international-1924"]
    latitude, height = np.deg2rad(40.0), 10e3
    s2 = math.sin(latitude) ** 2
    g_e, f, q = 9.78049, 1 / 297, 7.292115e-5**2 * 6378388 / 9.78049
    assert q == pytest.approx(0.00346775, rel=5e-5)  # the chapter's, which takes the Earth's rate to four digits
    e2 = 2 * f - f * f
    beta = 2.5 * q - 0.5 * e2
    assert beta == pytest.approx(0.0053, abs=2e-5)  # Clairaut
    m = 7.292115e-5**2 * 6378388**3 * (1 - f) / e.gm
    f2 = -f + 5 / 2 * m + f * f / 2 - 26 / 7 * f * m + 15 / 4 * m * m
    f4 = -f * f / 2 + 5 / 2 * f * m
    x = height / 6378388.0
    down = g_e * (1 + f2 * s2 + f4 * s2**2) * (1 - 2 * (1 + f + m - 2 * f * s2) * x + 3 * x * x)
    north = -g_e * beta * x * math.sin(2 * latitude)
    np.testing.assert_allclose(earth.gravity_ned(latitude, height, "order-1e-5", e), [north, 0, down], rtol=1e-12)
    np.testing.assert_allclose(
        earth.gravity_ned(latitude, height, "order-1e-4", e), [0, 0, g_e * (1 + beta * s2 - 2 * x)], rtol=1e-12
    )
    np.testing.assert_allclose(
        earth.gravity_ned(latitude, height, "order-1e-2", e), [0, 0, g_e * (1 - 2 * x)], rtol=1e-12
    )


@pytest.mark.parametrize("model", GRAVITY_MODELS)
def test_gravitation_is_gravity_without_the_centrifugal_part(model):
    for latitude, longitude, height in ((0.9, -2.0, 9e3), (-1.2, 3.0, -400.0), (0.0, 0.5, 3e4), (np.pi / 2, 0.0, 50.0)):
        r = np.float64(exact_ecef(latitude, longitude, height))
        expected = c_en(latitude, longitude) @ earth.gravity_ned(latitude, height, model)
        expected -= 7.292115e-5**2 * r * [1, 1, 0]
        np.testing.assert_allclose(earth.gravitation_ecef(r, model), expected, atol=2e-14, rtol=0)
    axis = earth.gravitation_ecef([0.0, 0.0, 6356752.314245179], model)  # exactly on the axis
    assert axis[:2] == pytest.approx([0, 0], abs=1e-15)
    assert axis[2] == pytest.approx(-9.83, abs=0.06)


# --- shapes and kernels -------------------------------------------------------------------------------------


def test_shapes_broadcast():
    assert earth.radii(0.5)[0].shape == ()
    assert earth.radii([[0.1, 0.2, 0.3]])[1].shape == (1, 3)
    assert earth.gravity_ned(0.5, 0).shape == (3,)
    assert earth.gravity_ned(np.zeros((4, 1)), np.arange(5)).shape == (4, 5, 3)
    assert earth.geodetic_to_ecef(np.zeros(7), 0.1, 0).shape == (7, 3)
    assert earth.geodetic_to_ecef([], [], []).shape == (0, 3)
    assert earth.q_en(np.zeros((2, 1)), np.zeros(3)).shape == (2, 3, 4)
    r = earth.geodetic_to_ecef(np.full((2, 3), 0.7), 0.1, 20.0)
    assert earth.gravitation_ecef(r).shape == (2, 3, 3)
    assert all(part.shape == (2, 3) for part in earth.ecef_to_geodetic(r))
    strided = np.repeat(LATITUDES, 3)[::3]
    np.testing.assert_array_equal(earth.radii(strided)[0], earth.radii(LATITUDES)[0])


def test_kernels_are_the_array_functions():
    p = earth.parameters(WGS84)
    latitude, longitude, height = 0.83, -2.1, 9e3
    r = earth.geodetic_to_ecef(latitude, longitude, height)
    s, c = math.sin(latitude), math.cos(latitude)
    r1, r2 = earth.radii(latitude)
    ulp = 4.5e-16
    np.testing.assert_allclose(earth.radii_k(p, s), (r1, r2), rtol=ulp)
    np.testing.assert_allclose(earth.geodetic_to_ecef_k(p, latitude, longitude, height), r, rtol=ulp)
    np.testing.assert_allclose(earth.ecef_to_geodetic_k(p, *r), (latitude, longitude, height), rtol=3e-13)
    np.testing.assert_allclose(earth.q_en_k(latitude, longitude), earth.q_en(latitude, longitude), rtol=ulp)
    for model, number in earth.GRAVITY_NUMBERS.items():
        expected = earth.gravity_ned(latitude, height, model)
        got = earth.gravity_ned_k(p, number, s, c, float(r2), height)
        np.testing.assert_allclose(got, expected[[0, 2]], rtol=ulp, atol=2e-15)
        np.testing.assert_allclose(
            earth.gravitation_ecef_k(p, number, *r), earth.gravitation_ecef(r, model), rtol=2 * ulp, atol=2e-15
        )


def test_the_chapters_constants_by_name():
    # chapter 8: g_e = 9.78049 m/s², q = 0.00346775, ω = 7.27e-5 rad/s, e² = 6.73e-3 on a = 6378388 m
    chapter = earth.ELLIPSOIDS["chapter"]
    assert (chapter.a, chapter.omega) == (6378388.0, 7.27e-5)
    assert chapter.e2 == pytest.approx(6.73e-3, rel=1e-12)
    assert chapter.gamma_e == pytest.approx(9.78049, rel=1e-15)
    latitude, height = np.deg2rad(55.0), 10000.0
    beta = 2.5 * 0.00346775 - 0.5 * 6.73e-3
    down = 9.78049 * (1 + beta * np.sin(latitude) ** 2 - 2 * height / 6378388.0)
    gravity = earth.gravity_ned(latitude, height, "order-1e-4", chapter)
    np.testing.assert_allclose(gravity, [0.0, 0.0, down], rtol=0, atol=4e-15)
    north = -9.78049 * beta * height / 6378388.0 * np.sin(2 * latitude)
    np.testing.assert_allclose(earth.gravity_ned(latitude, height, "order-1e-5", chapter)[0], north, rtol=1e-12, atol=0)
