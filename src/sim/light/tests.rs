use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3A};

use super::LightUse;
use super::bounds;
use super::cavity::Cavities;
use super::direct::{DirectLight, Emitter, EmitterRule};
use super::dome_map::{DomeGrid, bicubic, direction_from_disc, disc_from_direction};
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
    let mut layers: Vec<FlatLayer> = sheet
        .iter()
        .map(|&n| FlatLayer { name: "sheet".into(), index: [n; 3], thickness_mm: Some(1.0) })
        .collect();
    layers.push(FlatLayer { name: "dome".into(), index: [dome; 3], thickness_mm: None });
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
    SensorOptics::new(&OpticsSpec { lens, sensor_from_camera, layers, dome_radius_mm: 10.0 }).unwrap()
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
    assert_eq!(fresnel::returned(&[1.41, 1.41], &[1.41, 1.41], 1.1), 1.0);
    assert!((fresnel::returned(&[1.5], &[1.5], 0.0) - 0.04).abs() < 1e-12);
}

#[test]
fn a_dome_on_a_perfect_mirror_is_half_a_sphere() {
    // Without a sheet between, the mirrored dome closes the sphere: evenly lit, E_indirect = a / (1 - a) E.
    let optics = sensor(&[], 1.41);
    let rings = Rings { rings: 20, patches: 48 };
    let room = DomeRoom::new(&optics, rings, Underside::Perfect);
    for albedo in [0.2, 0.6, 0.9] {
        let balance = room.solve(&vec![1.0; rings.count()], albedo);
        let expected = albedo / (1.0 - albedo);
        let mean = balance.indirect.iter().sum::<f64>() / rings.count() as f64;
        assert!((mean / expected - 1.0).abs() < 5e-3 / (1.0 - albedo), "{albedo}: {mean} {expected}");
        assert!(balance.residual < 1e-6 * expected);
    }
}

#[test]
fn the_dome_alone_keeps_half_of_its_light() {
    // Form factor of a hemisphere to itself: 1/2. So E_indirect = (a/2) / (1 - a/2) E, exactly.
    let optics = sensor(&[1.49], 1.41);
    let room = DomeRoom::new(&optics, Rings::USUAL, Underside::Dark);
    for albedo in [0.1, 0.5, 0.95] {
        let balance = room.solve(&vec![2.0; Rings::USUAL.count()], albedo);
        let expected = 2.0 * (0.5 * albedo) / (1.0 - 0.5 * albedo);
        for e in &balance.indirect {
            assert!((e / expected - 1.0).abs() < 1e-8);
        }
    }
}

#[test]
fn interreflection_makes_no_light() {
    // What the membrane absorbs is what the lights put in, less what leaves through the underside; of a membrane's
    // own light less than all comes back, and more comes back with total reflection than without a mirror.
    let optics = sensor(&[1.494], 1.412);
    let room = DomeRoom::new(&optics, Rings::USUAL, Underside::Fresnel);
    let ones = vec![1.0; Rings::USUAL.count()];
    let back = room.irradiance(&ones);
    let share = back.iter().sum::<f64>() / ones.len() as f64;
    // Half straight; of the other half, 1 - 1/n^2 = 0.498 lies beyond the critical angle and returns, less what
    // escapes beside the dome's foot; of the rest a few percent.
    assert!(share > 0.65 && share < 0.5 + 0.5 * (0.499 + 0.05), "{share}");
    let finer = Rings { rings: 32, patches: 80 };
    let fine = DomeRoom::new(&optics, finer, Underside::Fresnel).irradiance(&vec![1.0; finer.count()]);
    let fine_share = fine.iter().sum::<f64>() / fine.len() as f64;
    assert!((share / fine_share - 1.0).abs() < 3e-3, "{share} {fine_share}");
    let direct: Vec<f64> = (0..ones.len()).map(|i| 1.0 + (i % 7) as f64).collect();
    let balance = room.solve(&direct, 0.8);
    let (input, exitance): (f64, f64) = (direct.iter().sum(), balance.exitance.iter().sum());
    let absorbed = (input + balance.indirect.iter().sum::<f64>()) * 0.2;
    let returned: f64 = balance.indirect.iter().sum();
    let left = exitance - returned;
    assert!(left > 0.0);
    assert!((absorbed + left - input).abs() < 1e-6 * input, "{absorbed} {left} {input}");
}

#[test]
fn the_map_of_the_dome_goes_both_ways_and_keeps_areas() {
    for direction in directions(300) {
        let disc = disc_from_direction(direction);
        assert!(disc.length() <= 1.0);
        assert!((direction_from_disc(disc) - direction).length() < 1e-12);
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
    let cavities = Cavities::of(&Construction { added: Vec::new(), cut });
    assert_eq!(cavities.count(), 3);
    let free = |a: [f64; 3], b: [f64; 3]| cavities.is_free(DVec3::from_array(a), DVec3::from_array(b));
    assert!(free([3.9, 0.0, 1.0], [0.1, 0.5, 1.5]), "inside the box");
    assert!(free([3.9, 0.0, 1.5], [-4.0, 0.0, 1.9]), "from the box into the cone");
    assert!(!free([3.9, 0.0, 0.2], [-4.5, 0.0, 0.2]), "the cone is narrow below");
    assert!(!free([3.9, 0.0, 1.0], [3.9, 0.0, 2.5]), "above the box");
    assert!(free([-2.0, 0.0, 0.1], [-2.0, 2.9, 3.9]), "up through cone and cylinder");
}

fn scene(more: &str) -> crate::Scene {
    let text = format!(
        r#"{{ "version": 1, "name": "lit", "design": "thumb24.json",
        "frames": {{ "count": 1, "rate_hz": 30 }}, "tolerance": {{ "px": 0.01, "grey": 0.5 }},
        "light": {{ "leds": {{ "level_per_mw_mm2": 450 }} }} {more} }}"#
    );
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    crate::Scene::from_text(&text, &folder).unwrap()
}

const ALL: LightUse = LightUse::ALL;

fn ways_of(optics: &SensorOptics, source: Emitter) -> Ways {
    Ways {
        sources: vec![Source { emitter: source, optics: optics.clone(), seen_mw: [1.0, 0.5, 0.0] }],
        optics: [optics.clone(), optics.clone(), optics.clone()],
        cavities: None,
        through_platform: 0.0,
        sheet_half_mm: WIDE,
        fresnel: false,
    }
}

#[test]
fn the_table_of_direct_light_matches_closed_forms_to_a_thousandth() {
    let optics = sensor(&[1.0], 1.0);
    let parts = FieldParts { falloff: true, albedo: None, moved: true };
    // A point on the sphere: even light.
    let at = DVec3::new(6.0, 0.0, -8.0);
    let ways = ways_of(&optics, emitter(at, -at, 1e-4, 1.0));
    let field = LightField::new(&ways, &Prepared::default(), &parts);
    for direction in directions(300) {
        let light = field.still(direction.as_vec3a()).to_array().map(f64::from);
        let exact = 1.0 / PI / 400.0;
        assert!((light[0] / exact - 1.0).abs() < 1e-3 && (light[1] / exact - 0.5).abs() < 1e-3);
        assert_eq!(light[2], 0.0);
    }
    // A square that faces the dome: Lambert's contour integral.
    let source = emitter(DVec3::new(4.0, -3.0, -3.3), DVec3::new(-0.4, 0.3, 1.0), 1.0, 1.0);
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
        .map(|(x, y)| source.platform_from_emitter.transform_point3(DVec3::new(x, y, 0.0)));
    let facing = source.platform_from_emitter.matrix3.z_axis;
    let field = LightField::new(&ways_of(&optics, source), &Prepared::default(), &parts);
    let brightest = field.brightest()[0];
    for direction in directions(300) {
        let point = direction * 10.0;
        if corners.iter().any(|c| (point - *c).dot(facing) < 0.0) {
            continue;
        }
        let exact = lambert_polygon(&corners, 1.0 / PI, point, -direction);
        let found = f64::from(field.still(direction.as_vec3a())[0]);
        assert!((found - exact).abs() < 1e-3 * brightest, "{direction}: {found} {exact}");
        // Moved points, with normals of their own.
        let moved = direction * 9.2;
        let normal = (direction + DVec3::new(0.1, -0.2, 0.1)).normalize();
        let exact = lambert_polygon(&corners, 1.0 / PI, moved, -normal);
        let found = f64::from(field.moved(moved.as_vec3a(), normal.as_vec3a())[0]);
        assert!((found - exact).abs() < 2e-2 * brightest, "moved {direction}: {found} {exact}");
    }
}

#[test]
fn the_rule_across_the_emitter_is_fine_enough() {
    let scene = scene("");
    let ways = setup::ways(&scene, &ALL).unwrap();
    let open = Ways { cavities: None, ..ways.clone() };
    let source = &ways.sources[0];
    let brightest = open.still(source, DVec3::Z, &EmitterRule::default());
    for direction in directions(12) {
        let rough = open.still(source, direction, &EmitterRule::default());
        let fine = open.still(source, direction, &EmitterRule::with_places(24));
        assert!((rough - fine).abs() < 1e-3 * brightest, "{direction}: {rough} {fine}");
        // With the shadow's edge across the emitter: against the same rule, and many more lines.
        let rough = ways.still(source, direction, &EmitterRule::default());
        let fine = ways.still(source, direction, &EmitterRule::with_places(24));
        assert!((rough - fine).abs() < 1e-2 * brightest, "shadow {direction}: {rough} {fine}");
    }
}

#[test]
fn shadows_only_darken_and_a_clear_platform_throws_none() {
    let scene = scene("");
    let shaded = setup::ways(&scene, &ALL).unwrap();
    let open = Ways { cavities: None, ..shaded.clone() };
    let clear = Ways { through_platform: 1.0, ..shaded.clone() };
    let rule = EmitterRule::default();
    let mut darkened = 0;
    for direction in directions(20) {
        for (i, source) in shaded.sources.iter().enumerate() {
            let (dark, light) =
                (shaded.still(source, direction, &rule), open.still(source, direction, &rule));
            assert!(dark <= light * (1.0 + 1e-2) + 1e-9, "{direction}: {dark} {light}");
            darkened += usize::from(dark < 0.9 * light);
            let through = clear.still(&clear.sources[i], direction, &rule);
            assert!((through - light).abs() <= 1e-9 * light.max(1e-9), "{through} {light}");
        }
    }
    assert!(darkened > 20, "the lip hides most of the emitter: {darkened}");
}

#[test]
fn the_sensor_is_lit_from_three_sides() {
    let scene = scene("");
    let mut work = Work::default();
    let dome = ShadedDome::new(&scene, &ALL, &mut work).unwrap().unwrap();
    let field = dome.field();
    assert!(field.error() < 0.02, "{}", field.error());
    assert!(work.of(EffectName::PlatformShadow) > work.of(EffectName::DirectLight));
    // Half way down, in the direction of each light, its colour is the strongest.
    for (light, azimuth_deg) in [0.0_f64, 120.0, 240.0].into_iter().enumerate() {
        let aside = DVec2::from_angle(azimuth_deg.to_radians()) * 0.76;
        let seen = field.still(aside.extend(0.65).normalize().as_vec3a()).to_array();
        let strongest = (0..3).max_by(|a, b| seen[*a].total_cmp(&seen[*b])).unwrap();
        assert_eq!(strongest, light, "{seen:?}");
    }
    // A point that was not moved has the same light by either table.
    let sample = |direction: DVec3, deformed| SurfaceSample {
        point_mm: (direction * 10.0).as_vec3a(),
        normal: direction.as_vec3a(),
        to_camera: Vec3A::NEG_Z,
        is_moved: deformed,
    };
    let moved_scene = self::scene(
        r#", "objects": [ { "name": "ball", "shape": { "kind": "sphere", "radius_mm": 4 },
             "path": [ { "time_s": 0, "position_mm": [0, 0, 40] } ] } ]"#,
    );
    let dome = ShadedDome::new(&moved_scene, &ALL, &mut work).unwrap().unwrap();
    let brightest = 450.0 * 0.55 / 2.0 * dome.field().brightest()[1];
    for direction in directions(60).filter(|d| d.z > 0.15) {
        let levels = [false, true].map(|is_moved| dome.level(&sample(direction, is_moved)));
        for c in 0..3 {
            let off = f64::from(levels[0][c] - levels[1][c]).abs();
            assert!(off < 0.03 * brightest, "{direction}: {levels:?}");
        }
    }
}

#[test]
fn numbers_for_lights_that_are_not_there_are_refused() {
    let text = scene("").file().clone();
    let mut file = text;
    file.light.leds.as_mut().unwrap().each = vec![1.0, 1.0];
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    let design = domecast_design::Design::load(&folder.join("thumb24.json")).unwrap();
    let scene = crate::Scene::new(file, &folder, design).unwrap();
    let error = setup::sources(&scene, &ALL).unwrap_err().to_string();
    assert!(error.contains("light.leds.each"), "{error}");
}

/// Largest difference of two light fields on the resting membrane, and of a moved one's shells.
fn largest_change(a: &ShadedDome, b: &ShadedDome, deformed: bool) -> f64 {
    let mut worst = 0.0_f64;
    for direction in directions(3_000) {
        let part = if deformed { (1.0 - direction.z).max(0.93) } else { 1.0 };
        let sample = SurfaceSample {
            point_mm: (direction * (10.0 * part)).as_vec3a(),
            normal: direction.as_vec3a(),
            to_camera: Vec3A::NEG_Z,
            is_moved: deformed,
        };
        worst = worst.max(f64::from((a.level(&sample) - b.level(&sample)).abs().max_element()));
    }
    worst
}

#[test]
fn no_effect_of_light_passes_its_bound() {
    let object = r#", "objects": [ { "name": "ball", "shape": { "kind": "sphere", "radius_mm": 4 },
             "path": [ { "time_s": 0, "position_mm": [0, 0, 40] } ] } ]"#;
    for more in ["", object] {
        let scene = scene(more);
        let bound = bounds::LightBounds::of(&scene).unwrap();
        let lit = |used: LightUse| ShadedDome::new(&scene, &used, &mut Work::default()).unwrap().unwrap();
        let open = LightUse { platform_shadow: false, ..ALL };
        let contexts = if more.is_empty() {
            vec![ALL, LightUse { diffuser: false, ..open }, LightUse { interreflection: false, ..open }]
        } else {
            vec![open]
        };
        let mut largest = [0.0_f64; 6];
        for used in contexts {
            let all = lit(used);
            let bounded = [
                (bound.falloff, LightUse { falloff: !used.falloff, ..used }),
                (bound.diffuser, LightUse { diffuser: !used.diffuser, ..used }),
                (bound.fresnel, LightUse { fresnel: !used.fresnel, ..used }),
                (bound.platform_shadow, LightUse { platform_shadow: !used.platform_shadow, ..used }),
                (bound.interreflection, LightUse { interreflection: !used.interreflection, ..used }),
            ];
            for (k, (bound, other)) in bounded.into_iter().enumerate() {
                let found = largest_change(&all, &lit(other), !more.is_empty());
                assert!(found <= bound, "{used:?} and {other:?}: {found} {bound}");
                largest[k] = largest[k].max(found / bound);
            }
            let dark =
                ShadedDome::new(&self::scene_of_power(0.0), &used, &mut Work::default()).unwrap().unwrap();
            let brightest = largest_change(&all, &dark, !more.is_empty());
            assert!(brightest <= bound.brightest, "{used:?}: {brightest} {bound:?}");
            largest[5] = largest[5].max(brightest / bound.brightest);
        }
        println!("largest over bound: {largest:.2?}");
        // A bound may be too large, but not by so much that nothing can ever be spared.
        let least = if more.is_empty() { 0.04 } else { 0.005 };
        assert!(largest.iter().all(|part| *part > least), "{largest:?}");
    }
}

fn scene_of_power(power: f64) -> crate::Scene {
    let mut file = scene("").file().clone();
    file.light.leds.as_mut().unwrap().power = power;
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    let design = domecast_design::Design::load(&folder.join("thumb24.json")).unwrap();
    crate::Scene::new(file, &folder, design).unwrap()
}

#[test]
fn codes_change_most_from_dark() {
    assert_eq!(bounds::grey_of_change(1.0, 2.0), 255.0);
    assert!((bounds::grey_of_change(2.0, 0.01) - 25.5).abs() < 1e-9);
    assert!((bounds::grey_of_change(0.5, 0.01) - 5.1).abs() < 1e-9);
}

/// What Mitsuba found for the same sensor; made by scripts/golden_light.py.
fn golden() -> serde_json::Value {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("tests/cases/golden_light.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap()
}

/// The light of the golden file: `designs/thumb24.json`'s first, as a square or a point.
fn golden_emitter(golden: &serde_json::Value, side_mm: f64) -> Emitter {
    let light = &golden["light"];
    let tilt = number(&light["tilt_deg"]).to_radians();
    let at = DVec3::new(number(&light["radius_mm"]), 0.0, number(&light["z_mm"]));
    let z = DVec3::new(-tilt.sin(), 0.0, tilt.cos());
    let y = DVec3::new(tilt.cos(), 0.0, tilt.sin());
    let pose = DAffine3 { matrix3: DMat3::from_cols(y.cross(z), y, z), translation: at };
    Emitter {
        platform_from_emitter: pose,
        half_side_mm: 0.5 * side_mm,
        flux_mw: 1.0,
        lobe: Lobe::cosine_power(1.0),
    }
}

/// Largest difference of a map of irradiance from Mitsuba's, of each bin's value or a tenth of the largest; a bin
/// that the light reaches at a cosine below the cut is left out.
fn off_from_mitsuba(golden: &serde_json::Value, map: &str, emitter: &Emitter, min_cos: f64) -> (f64, usize) {
    let optics = sensor(&[number(&golden["acrylic_index"])], number(&golden["silicone_index"]));
    let light = DirectLight { fresnel: true, ..light(&optics) };
    let edges: Vec<f64> =
        golden["polar_edges_deg"].as_array().unwrap().iter().map(|v| number(v).to_radians()).collect();
    let count = golden["azimuths"].as_u64().unwrap() as usize;
    let rule = EmitterRule::default();
    let value = |ring: usize, k: usize| number(&golden[map][ring][k]);
    let largest = (0..edges.len() - 1).flat_map(|r| (0..count).map(move |k| (r, k)));
    let largest = largest.map(|(r, k)| value(r, k)).fold(0.0, f64::max);
    let (mut worst, mut compared) = (0.0_f64, 0);
    for ring in 0..edges.len() - 1 {
        for k in 0..=count / 2 {
            let (mut sum, mut weights, mut seen) = (0.0, 0.0, true);
            for i in 0..8 {
                let polar = edges[ring] + (edges[ring + 1] - edges[ring]) * (f64::from(i) + 0.5) / 8.0;
                for j in 0..8 {
                    let azimuth = TAU * (k as f64 - 0.5 + (f64::from(j) + 0.5) / 8.0) / count as f64;
                    let direction = (DVec2::from_angle(azimuth) * polar.sin()).extend(polar.cos());
                    let point = direction * 10.0;
                    sum += polar.sin() * light.vector_irradiance(emitter, point, &rule).dot(direction);
                    weights += polar.sin();
                    let pose = &emitter.platform_from_emitter;
                    let tube = optics.light_tube(pose.translation, point, 0.0).unwrap();
                    seen &= tube.leaving.dot(pose.matrix3.z_axis) > min_cos;
                }
            }
            if !seen {
                continue;
            }
            // The sensor is its own mirror image, so two bins of Mitsuba's noise make one.
            let other = 0.5 * (value(ring, k) + value(ring, (count - k) % count));
            worst = worst.max((sum / weights - other).abs() / other.max(0.1 * largest));
            compared += 1;
        }
    }
    (worst, compared)
}

#[test]
fn irradiance_is_that_of_mitsuba() {
    let golden = golden();
    let square = golden_emitter(&golden, number(&golden["square_side_mm"]));
    let (off, compared) = off_from_mitsuba(&golden, "square", &square, -1.0);
    println!("square: {:.2} % in {compared} bins", 100.0 * off);
    assert!(off < 0.03 && compared == 35, "{off} {compared}");
    let mut point = golden_emitter(&golden, 1e-3);
    point.lobe = point.lobe.behind(&Diffuser {
        lambert_fraction: number(&golden["diffuser"]["lambert_fraction"]),
        lobe_width_rad: number(&golden["diffuser"]["lobe_width_deg"]).to_radians(),
        transmittance: 1.0,
    });
    let cut = (number(&golden["cutoff_deg"]) - 1.0).to_radians().cos();
    let (off, compared) = off_from_mitsuba(&golden, "diffused", &point, cut);
    println!("diffused: {:.2} % in {compared} bins", 100.0 * off);
    assert!(off < 0.03 && compared > 28, "{off} {compared}");
}

#[test]
fn dots_are_seen_where_mitsuba_sees_them() {
    let golden = golden();
    let focal = number(&golden["focal_px"]);
    let layer = |n: &serde_json::Value, thickness_mm| FlatLayer {
        name: "layer".into(),
        index: [number(n); 3],
        thickness_mm,
    };
    let optics = SensorOptics::new(&OpticsSpec {
        lens: LensSpec {
            model: LensModel::Pinhole,
            width: 640,
            height: 480,
            matrix: [[focal, 0.0, 319.5], [0.0, focal, 239.5], [0.0, 0.0, 1.0]],
            distortion: Vec::new(),
            field_of_view_rad: 2.7,
            pupil_shift_mm: Vec::new(),
        },
        sensor_from_camera: Rigid::from_translation(DVec3::Z * number(&golden["pupil_z_mm"])),
        layers: vec![
            layer(&golden["acrylic_index"], Some(number(&golden["sheet_mm"]))),
            layer(&golden["silicone_index"], None),
        ],
        dome_radius_mm: 10.0,
    })
    .unwrap();
    let reach = number(&golden["dot_radius_mm"]) / 10.0;
    let vector = |v: &serde_json::Value| -> Vec<f64> { v.as_array().unwrap().iter().map(number).collect() };
    let (places, pixels) = (golden["dots_mm"].as_array().unwrap(), golden["dots_px"].as_array().unwrap());
    let mut worst = 0.0_f64;
    for (place, pixel) in places.iter().zip(pixels) {
        let axis = DVec3::from_slice(&vector(place)).normalize();
        let (x, y) = (axis.any_orthonormal_vector(), axis.cross(axis.any_orthonormal_vector()));
        let rim: Vec<DVec2> = (0..96)
            .map(|k| {
                let aside = DVec2::from_angle(TAU * f64::from(k) / 96.0) * reach.sin();
                optics.project((x * aside.x + y * aside.y + axis * reach.cos()) * 10.0).unwrap()
            })
            .collect();
        let origin = rim[0];
        let (mut area, mut center) = (0.0, DVec2::ZERO);
        for (a, b) in rim.iter().zip(rim.iter().cycle().skip(1)) {
            let part = (*a - origin).perp_dot(*b - origin);
            area += part;
            center += (*a + *b - 2.0 * origin) * (part / 3.0);
        }
        let found = vector(pixel);
        worst = worst.max((origin + center / area).distance(DVec2::new(found[0], found[1])));
    }
    println!("{} dots, at most {worst:.4} px from Mitsuba's", places.len());
    assert!(worst < 0.05 && places.len() >= 45, "{worst}");
}

#[test]
fn a_change_of_light_changes_no_code_by_more_than_its_bound_and_none_by_more_than_the_scale() {
    for gamma in [0.5, 1.0, 2.2] {
        let code = |light: f64| 255.0 * light.clamp(0.0, 1.0).powf(1.0 / gamma);
        for i in 0..60 {
            for j in 0..60 {
                let (before, after) = (f64::from(i) * 0.05, f64::from(j) * 0.05);
                let most = super::bounds::grey_of_change(gamma, (after - before).abs());
                let found = (code(after) - code(before)).abs();
                assert!(found <= most + 1e-9 && most <= 255.0, "{gamma} {before} {after}: {found} {most}");
            }
        }
    }
}
