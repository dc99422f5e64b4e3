mod domes;
mod mitsuba;
mod photons;
mod room;
mod tables;

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3A};

use super::LightUse;
use super::bounds;
use super::bounds::CoarseLight;
use super::direct::{DirectLight, Emitter, EmitterRule};
use super::dome_map::{DomeFace, DomeGrid, bicubic};
use super::field::{FieldParts, LightField};
use super::fresnel;
use super::lobe::{Diffuser, Lobe};
use super::quadrature::GaussRule;
use super::radiosity::{DomeRoom, Rings, Underside};
use super::setup;
use super::shade::ShadedDome;
use super::tables::{Prepared, Source, Ways};
use crate::{EffectName, Shading, SurfaceSample, Work};
use domecast_optics::camera::{LensModel, LensSpec};
use domecast_optics::numeric::Rigid;
use domecast_optics::{FlatLayer, OpticsSpec, SensorOptics};

const WIDE: DVec2 = DVec2::splat(1e6);

/// A sensor with a sheet of the given indices, 1 mm of each, and a dome of radius 10 mm.
fn sensor(sheet: &[f64], dome: f64) -> SensorOptics {
    sensor_of(sheet, dome, 10.0)
}

/// The same with a dome of another radius, mm.
fn sensor_of(sheet: &[f64], dome: f64, dome_radius_mm: f64) -> SensorOptics {
    sensor_with(sheet, dome, domecast_optics::DomeShape::hemisphere(dome_radius_mm))
}

/// The same with a dome of another shape.
fn sensor_with(sheet: &[f64], index: f64, dome: domecast_optics::DomeShape) -> SensorOptics {
    let mut layers: Vec<FlatLayer> = sheet
        .iter()
        .map(|&n| FlatLayer { name: "sheet".into(), index: [n; 3], thickness_mm: Some(1.0) })
        .collect();
    layers.push(FlatLayer { name: "dome".into(), index: [index; 3], thickness_mm: None });
    let lens = LensSpec {
        model: LensModel::Pinhole,
        width: 640,
        height: 480,
        matrix: [[200.0, 0.0, 319.5], [0.0, 200.0, 239.5], [0.0, 0.0, 1.0]],
        distortion: Vec::new(),
        field_of_view_rad: 2.0,
        pupil_shift_mm: Vec::new(),
    };
    let sensor_from_camera = Rigid::from_translation(DVec3::new(0.0, 0.0, -10.0));
    SensorOptics::new(&OpticsSpec { lens, sensor_from_camera, layers, dome }).unwrap()
}

/// A square emitter at a place, facing a direction.
fn emitter(at: DVec3, facing: DVec3, side_mm: f64, exponent: f64) -> Emitter {
    let z = facing.normalize();
    let x = z.any_orthonormal_vector();
    let pose = DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: at };
    Emitter {
        platform_from_emitter: pose,
        half_side_mm: 0.5 * side_mm,
        flux_mw: 1.0,
        lobe: Lobe::cosine_power(exponent),
    }
}

fn light(optics: &SensorOptics) -> DirectLight<'_> {
    DirectLight { optics, cavities: None, through_platform: 0.0, sheet_half_mm: WIDE, fresnel: false }
}

fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = (i as f64 + 0.5) / count as f64;
        (DVec2::from_angle(2.399_963_23 * i as f64) * (1.0 - z * z).sqrt()).extend(z)
    })
}

/// Irradiance of a surface by a Lambertian polygon of radiance `flux / (pi area)`: Lambert's contour integral.
fn lambert_polygon(corners: &[DVec3], radiance: f64, point: DVec3, towards_light: DVec3) -> f64 {
    let n = corners.len();
    let sum: f64 = (0..n)
        .map(|i| {
            let (a, b) = ((corners[i] - point).normalize(), (corners[(i + 1) % n] - point).normalize());
            a.cross(b).normalize().dot(towards_light) * a.dot(b).clamp(-1.0, 1.0).acos()
        })
        .sum();
    0.5 * radiance * sum.abs()
}

#[test]
fn a_lambertian_point_on_a_sphere_lights_all_of_it_alike() {
    // The source on the sphere's lower half, facing the centre; all indices 1. E = I0 / (4 R^2).
    let optics = sensor(&[1.0], 1.0);
    let at = DVec3::new(6.0, 0.0, -8.0);
    let source = emitter(at, -at, 1e-4, 1.0);
    let expected = 1.0 / PI / 400.0;
    for direction in directions(50) {
        let found = light(&optics).vector_irradiance(&source, direction * 10.0, &EmitterRule::default());
        assert!((found.dot(direction) / expected - 1.0).abs() < 1e-6, "{direction}");
    }
}

#[test]
fn a_square_emitter_matches_lamberts_contour_integral() {
    let optics = sensor(&[1.0], 1.0);
    for (at, facing) in [
        (DVec3::new(9.0, 0.0, -3.3), DVec3::new(-1.0, 0.0, 0.4)),
        (DVec3::new(0.0, 5.0, -2.5), DVec3::new(0.2, 0.1, 1.0)),
    ] {
        let source = emitter(at, facing, 1.0, 1.0);
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
            .map(|(x, y)| source.platform_from_emitter.transform_point3(DVec3::new(x, y, 0.0)));
        let mut compared = 0;
        for direction in directions(200) {
            let point = direction * 10.0;
            // The formula is for points that see all of the emitter's face.
            if corners.iter().any(|c| (point - *c).dot(source.platform_from_emitter.matrix3.z_axis) < 0.3) {
                continue;
            }
            compared += 1;
            let exact = lambert_polygon(&corners, 1.0 / PI, point, -direction);
            let found = light(&optics).vector_irradiance(&source, point, &EmitterRule::default());
            assert!((found.dot(direction) / exact - 1.0).abs() < 1e-4, "{direction}: {found} {exact}");
        }
        assert!(compared > 80);
    }
}

#[test]
fn light_bent_by_the_sheet_keeps_its_flux() {
    // All light of a source below that enters the sheet within the critical cone of directions meets either the
    // dome or the level plane; close the room with a large dome whose base takes all of it in.
    let optics = sensor(&[1.49], 1.41);
    let source = emitter(DVec3::new(1.0, -0.5, -2.0), DVec3::Z, 1e-3, 1.0);
    let rule = GaussRule::new(200);
    let mut flux = 0.0;
    for &(z, weight) in rule.nodes() {
        for k in 0..200 {
            let azimuth = TAU * (k as f64 + 0.5) / 200.0;
            let direction = (DVec2::from_angle(azimuth) * (1.0 - z * z).sqrt()).extend(z);
            let found =
                light(&optics).vector_irradiance(&source, direction * 10.0, &EmitterRule::with_places(1));
            flux += found.dot(direction) * weight / 200.0;
        }
    }
    flux *= TAU * 100.0;
    // What passes the base within the dome: rays whose foot lies within 10 mm, by their angle in air; cos^1 has
    // the flux sin^2 within a cone. Integrated over the azimuth in closed form for the angle of the edge.
    let exact: f64 = (0..4_000)
        .map(|k| {
            let aside = DVec2::from_angle(TAU * (k as f64 + 0.5) / 4_000.0);
            let reach = |sin: f64| {
                let tan = |n: f64| sin / (n * n - sin * sin).sqrt();
                DVec2::new(1.0, -0.5) + aside * (1.0 * tan(1.0) + 1.0 * tan(1.49))
            };
            let (mut low, mut high) = (0.0, 1.0 - 1e-15);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if reach(middle).length() < 10.0 { low = middle } else { high = middle }
            }
            low * low / 4_000.0
        })
        .sum();
    assert!((flux / exact - 1.0).abs() < 1e-3, "{flux} {exact}");
}

#[test]
fn a_small_lambert_light_under_a_flat_sheet_has_its_closed_form() {
    // A cone of air angle with sine s comes to r(s), the sum of h s / sqrt(n^2 - s^2) over the layers. Of flux 1 what
    // passes within it is s^2, so the irradiance of the level plane is 2 s ds / (2 pi r dr).
    let optics = sensor(&[1.49], 1.41);
    let source = emitter(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 1e-3, 1.0);
    let layers = |z: f64| [(1.0, 1.0), (1.0, 1.49), (z, 1.41)];
    for (z, sine) in [(3.0, 0.2_f64), (3.0, 0.6), (1.5, 0.85), (6.0, 0.8)] {
        let over = |n: f64| (n * n - sine * sine).sqrt();
        let radius: f64 = layers(z).iter().map(|(h, n)| h * sine / over(*n)).sum();
        let change: f64 = layers(z).iter().map(|(h, n)| h * n * n / over(*n).powi(3)).sum();
        let exact = sine / (std::f64::consts::PI * radius * change);
        let point = DVec3::new(radius * 0.6, radius * 0.8, z);
        let found = light(&optics).vector_irradiance(&source, point, &EmitterRule::default());
        assert!((found.z / exact - 1.0).abs() < 1e-5, "{z} {sine}: {} {exact}", found.z);
        let tangent = found.truncate().length() / found.z;
        assert!((tangent * over(1.41) / sine - 1.0).abs() < 1e-5, "{z} {sine}: {tangent}");
    }
}

#[test]
fn diffusers_keep_the_energy() {
    for exponent in [0.0, 1.0, 3.5, 20.0] {
        let bare = Lobe::cosine_power(exponent);
        assert!((bare.integral() - 1.0).abs() < 2e-4, "{exponent}: {}", bare.integral());
        for (lambert_fraction, width_deg) in [(1.0, 30.0), (0.0, 12.0), (0.3, 25.0), (0.6, 60.0)] {
            let diffuser =
                Diffuser { lambert_fraction, lobe_width_rad: f64::to_radians(width_deg), transmittance: 0.8 };
            let found = bare.behind(&diffuser);
            assert!((found.flux() - 0.8).abs() < 1e-12);
            assert!(
                (found.integral() / 0.8 - 1.0).abs() < 5e-4,
                "{exponent} {width_deg}: {}",
                found.integral()
            );
        }
    }
}

#[test]
fn a_narrow_lobe_changes_nothing_and_a_full_lambert_share_forgets_all() {
    let bare = Lobe::cosine_power(2.0);
    let narrow = bare.behind(&Diffuser { lambert_fraction: 0.0, lobe_width_rad: 0.03, transmittance: 1.0 });
    let lambert = bare.behind(&Diffuser { lambert_fraction: 1.0, lobe_width_rad: 0.3, transmittance: 1.0 });
    for cos in [0.3, 0.6, 0.9, 0.99] {
        assert!((narrow.per_sr(cos) / bare.per_sr(cos) - 1.0).abs() < 0.01, "{cos}");
        assert!((lambert.per_sr(cos) - cos / PI).abs() < 1e-9);
    }
    assert_eq!(bare.per_sr(-0.1), 0.0);
}

#[test]
fn a_diffuser_at_most_doubles_the_densest_direction() {
    for exponent in [1.0, 2.0, 8.0] {
        let bare = Lobe::cosine_power(exponent);
        for width_deg in [4.0_f64, 15.0, 40.0, 90.0] {
            let lobe_width_rad = width_deg.to_radians();
            let lobe = bare.behind(&Diffuser { lambert_fraction: 0.0, lobe_width_rad, transmittance: 1.0 });
            let densest = (1..=100).map(|i| lobe.per_sr(f64::from(i) / 100.0)).fold(0.0, f64::max);
            assert!(densest < 2.0 * (exponent + 1.0) / TAU, "{exponent} {width_deg}: {densest}");
        }
    }
}

#[test]
fn fresnel_splits_without_loss_and_stops_at_the_critical_angle() {
    // normal incidence: ((n - 1) / (n + 1))^2
    let [s, p] = fresnel::transmitted(1.0, 1.5, 0.0);
    assert!((s - 0.96).abs() < 1e-12 && (p - 0.96).abs() < 1e-12);
    // Brewster's angle lets all of one polarisation through
    let brewster = 1.5_f64.atan().sin();
    assert!((fresnel::transmitted(1.0, 1.5, brewster)[1] - 1.0).abs() < 1e-12);
    // the same both ways
    let (up, down) = (fresnel::transmitted(1.0, 1.5, 0.7), fresnel::transmitted(1.5, 1.0, 0.7));
    assert!((up[0] - down[0]).abs() < 1e-14 && (up[1] - down[1]).abs() < 1e-14);
    assert_eq!(fresnel::transmitted(1.5, 1.0, 1.2), [0.0; 2]);
    for share in [fresnel::returned, fresnel::turned] {
        assert_eq!(share(&[1.41, 1.41], 1.1), 1.0);
        assert!((share(&[1.5], 0.0) - 0.04).abs() < 1e-12);
    }
    // What does not leave comes back, after any number of turns: a slow sum over them.
    let (indices, momentum) = ([1.41, 1.494], 0.9);
    let mut slow = 0.0;
    let [upper, lower] =
        [(indices[0], indices[1]), (indices[1], 1.0)].map(|(a, b)| fresnel::transmitted(a, b, momentum));
    for k in 0..2 {
        let (mut inside, mut back) = (upper[k], 1.0 - upper[k]);
        for _ in 0..200 {
            inside *= 1.0 - lower[k];
            back += inside * upper[k];
            inside *= 1.0 - upper[k];
        }
        slow += 0.5 * back;
    }
    assert!((fresnel::returned(&indices, momentum) / slow - 1.0).abs() < 1e-12, "{slow}");
    // Along the sheet the upper face throws back much, and nothing of it is lost.
    assert!(fresnel::turned(&indices, 1.39) < 0.9 && fresnel::returned(&indices, 1.39) == 1.0);
}

#[test]
fn the_map_of_the_dome_goes_both_ways_and_keeps_areas() {
    for direction in directions(300) {
        let disc = DomeFace::HEMISPHERE.disc(direction);
        assert!(disc.length() <= 1.0);
        assert!((DomeFace::HEMISPHERE.place_of_disc(disc) - direction).length() < 1e-12);
        // half of the disc's area lies above the half of the hemisphere's
        assert!((disc.length_squared() - (1.0 - direction.z)).abs() < 1e-12);
    }
}

#[test]
fn a_table_of_something_smooth_is_exact_to_its_order() {
    let value = |d: DVec3| [(3.0 * d.x).sin() + d.y * d.z, d.z];
    let mut before = f64::INFINITY;
    for cells in [16, 32, 64] {
        let grid = DomeGrid::with_cells(cells);
        let table = grid.fill_in_parallel(value);
        let worst = directions(500)
            .map(|d| {
                let found = bicubic(&grid, &table, grid.coordinates(d));
                (found[0] - value(d)[0]).abs().max((found[1] - value(d)[1]).abs())
            })
            .fold(0.0, f64::max);
        assert!(worst < 0.3 * before, "{cells}: {worst} {before}");
        before = worst;
    }
    assert!(before < 1e-3, "{before}");
}

#[test]
fn the_way_is_free_where_the_hollows_join() {
    use domecast_mesh::{Construction, Fit, Piece, Profile, Shape};
    let cut = vec![
        Piece::new("box", Shape::cuboid(DVec3::new(0.0, -1.0, 0.0), DVec3::new(4.0, 1.0, 2.0))),
        Piece::new(
            "cone",
            Shape::Turned {
                profile: Profile::lines(&[(1.0, 0.0), (3.0, 2.0), (3.0, 4.0)]),
                fit: Fit::Outside,
            },
        )
        .at(-2.0, 0.0),
    ];
    let cavities = super::hollows::hollows_of(&Construction { added: Vec::new(), cut });
    assert_eq!(cavities.count(), 3);
    let free = |a: [f64; 3], b: [f64; 3]| cavities.is_free(DVec3::from_array(a), DVec3::from_array(b));
    assert!(free([3.9, 0.0, 1.0], [0.1, 0.5, 1.5]), "inside the box");
    assert!(free([3.9, 0.0, 1.5], [-4.0, 0.0, 1.9]), "from the box into the cone");
    assert!(!free([3.9, 0.0, 0.2], [-4.5, 0.0, 0.2]), "the cone is narrow below");
    assert!(!free([3.9, 0.0, 1.0], [3.9, 0.0, 2.5]), "above the box");
    assert!(free([-2.0, 0.0, 0.1], [-2.0, 2.9, 3.9]), "up through cone and cylinder");
}
