use std::f64::consts::PI;

use glam::{DAffine3, DVec2, DVec3};
use proptest::prelude::*;

use super::*;

fn chord(t: f64) -> Chord {
    Chord::new(t).unwrap()
}

const SWEEP_MM: [f64; 5] = [0.1, 0.03, 0.01, 0.003, 0.001];
const FITS: [Fit; 3] = [Fit::Inside, Fit::Outside, Fit::Area];

/// A dome on a cylinder: the shape of a mould's cavity.
fn dome(fit: Fit) -> Shape {
    let r = 10.0;
    Shape::Turned {
        profile: Profile {
            points_mm: vec![DVec2::new(0.0, -r), DVec2::new(r, 0.0), DVec2::new(r, 2.0)],
            edges: vec![ProfileEdge::Arc { center_z_mm: 0.0 }, ProfileEdge::Line],
        },
        fit,
    }
}

/// Distance of a point from the surface of `dome`, where it is near it.
fn dome_distance(p: DVec3) -> f64 {
    let rho = p.truncate().length();
    if p.z <= 0.0 { (p.length() - 10.0).abs() } else { (rho - 10.0).abs().min((p.z - 2.0).abs()) }
}

#[test]
fn sides_keep_the_chord_tolerance_and_no_more() {
    for tolerance in SWEEP_MM {
        for radius in [0.25, 3.0, 12.0, 200.0] {
            let sagitta = |n: f64| radius * (1.0 - (PI / n).cos());
            let n = f64::from(chord(tolerance).circle_segments(radius, Fit::Inside).unwrap());
            assert!(sagitta(n) <= tolerance);
            // Rounded up to a multiple of four, at least eight: four fewer
            // would be too few.
            assert!(n <= 8.0 || sagitta(n - 4.0) > tolerance, "{radius} {tolerance} {n}");
        }
    }
    assert!(Chord::new(0.0).is_err() && Chord::new(f64::NAN).is_err());
    assert!(matches!(chord(1e-9).circle_segments(200.0, Fit::Area), Err(MeshError::TooManyTriangles { .. })));
}

#[test]
fn dome_stays_within_tolerance_and_on_the_promised_side() {
    for tolerance in SWEEP_MM {
        for fit in FITS {
            let mesh = dome(fit).triangulate("dome", chord(tolerance)).unwrap();
            let report = inspect(&mesh.welded_f32());
            assert!(report.is_one_solid(), "{tolerance} {fit:?}: {:?}", report.problem());
            assert_eq!(report.genus(), Some(0));
            let mut worst = 0.0_f64;
            for [a, b, c] in mesh.iter_mm() {
                for (u, v) in [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (1.0 / 3.0, 1.0 / 3.0)] {
                    let p = a + (b - a) * u + (c - a) * v;
                    worst = worst.max(dome_distance(p));
                    if p.z < 0.0 {
                        match fit {
                            Fit::Inside => assert!(p.length() <= 10.0 + 1e-12),
                            Fit::Outside => assert!(p.length() >= 10.0 - 1e-9, "{p}"),
                            Fit::Area => {}
                        }
                    }
                }
            }
            assert!(worst <= tolerance, "{fit:?} at {tolerance}: {worst}");
        }
    }
}

#[test]
fn volume_converges_to_the_closed_form() {
    for fit in FITS {
        let shape = dome(fit);
        let exact = shape.volume_mm3();
        let closed_form = PI * (2.0 / 3.0 * 1000.0 + 200.0);
        assert!((exact / closed_form - 1.0).abs() < 1e-14);
        let error = |t: f64| (shape.triangulate("dome", chord(t)).unwrap().volume_mm3() / exact - 1.0).abs();
        let (coarse, fine) = (error(0.1), error(0.001));
        // First order in the tolerance: a hundredth, with room for rounding
        // up of the number of sides.
        assert!(fine < coarse / 60.0, "{fit:?}: {coarse} -> {fine}");
    }
    let pin = Shape::cylinder(3.0, -1.0, 4.0, Fit::Area);
    let mesh = pin.triangulate("pin", chord(0.1)).unwrap();
    assert!((mesh.volume_mm3() / (PI * 45.0) - 1.0).abs() < 1e-14, "Fit::Area keeps the area");
}

#[test]
fn rounded_plate_has_its_exact_volume_in_the_limit() {
    let plate = Shape::rounded_plate(DVec2::new(20.0, 10.0), 2.0, 0.0, 3.0);
    let exact = 3.0 * (200.0 - (4.0 - PI) * 4.0);
    assert!((plate.volume_mm3() - exact).abs() < 1e-10);
    let mesh = plate.triangulate("plate", chord(1e-5)).unwrap();
    assert!((mesh.volume_mm3() - exact).abs() < 1e-3);
    assert_eq!(inspect(&mesh).genus(), Some(0));
}

#[test]
fn drilled_plate_has_the_genus_and_volume_of_its_holes() {
    let mut construction = Construction {
        added: vec![Piece::new(
            "plate",
            Shape::cuboid(DVec3::new(-12.0, -12.0, 0.0), DVec3::new(12.0, 12.0, 4.0)),
        )],
        cut: vec![],
    };
    for i in 0..5 {
        let hole = Shape::cylinder(1.0, -1.0, 5.0, Fit::Area);
        construction.cut.push(Piece::new("hole", hole).at(-8.0 + 4.0 * f64::from(i), 3.0));
    }
    // A pocket whose floor is flush with nothing, and a slot tilted by 85 degrees.
    construction.cut.push(Piece::new("pocket", Shape::cylinder(1.5, 2.9, 5.0, Fit::Outside)).at(0.0, -5.0));
    let solid = construction.solid(chord(0.01)).unwrap();
    let report = inspect(&solid.to_mesh().welded_f32());
    assert!(report.is_one_solid(), "{:?}", report.problem());
    assert_eq!(report.genus(), Some(5));
    let exact = 24.0 * 24.0 * 4.0 - 5.0 * 4.0 * PI;
    let pocket = PI * 1.5 * 1.5 * 1.1;
    assert!((report.volume_mm3 - (exact - pocket)).abs() < 0.1);
}

#[test]
fn inspection_finds_each_kind_of_damage() {
    let cube = Shape::cuboid(DVec3::ZERO, DVec3::ONE).triangulate("cube", chord(0.1)).unwrap();
    assert!(inspect(&cube).is_one_solid());

    let mut open = cube.clone();
    open.triangles.pop();
    assert_eq!(inspect(&open).open_edges, 3);

    let mut flipped = cube.clone();
    flipped.triangles[0].swap(0, 1);
    assert_eq!(inspect(&flipped).flipped_edges, 3);

    let mut inside_out = cube.clone();
    inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!(inspect(&inside_out).is_closed() && !inspect(&inside_out).is_one_solid());

    let mut two = cube.clone();
    two.append(&cube.transformed(&DAffine3::from_translation(DVec3::new(3.0, 0.0, 0.0))));
    assert_eq!(inspect(&two).shells, 2);

    // Two cubes that share one corner after welding.
    let mut pinched = cube.clone();
    pinched.append(&cube.transformed(&DAffine3::from_translation(DVec3::ONE)));
    let report = inspect(&pinched.welded_f32());
    assert_eq!((report.pinched_vertices, report.open_edges), (1, 0));

    // Two cubes that share an edge.
    let mut touching = cube.clone();
    touching.append(&cube.transformed(&DAffine3::from_translation(DVec3::new(1.0, 1.0, 0.0))));
    assert_eq!(inspect(&touching.welded_f32()).open_edges, 1);
    assert!(inspect(&TriMesh::default()).problem().is_some());
}

#[test]
fn stl_reads_back_as_the_welded_mesh() {
    let mesh = dome(Fit::Area).triangulate("dome", chord(0.05)).unwrap().welded_f32();
    let mut bytes = Vec::new();
    write_stl(&mesh, &mut bytes).unwrap();
    assert_eq!(bytes.len(), 84 + 50 * mesh.triangles.len());
    let read = stl_io::read_stl(&mut std::io::Cursor::new(&bytes)).unwrap();
    assert_eq!(read.faces.len(), mesh.triangles.len());
    assert_eq!(read.vertices.len(), mesh.vertices_mm.len());
    read.validate().unwrap();
}

#[test]
fn nonsense_is_refused_by_name() {
    for shape in [
        Shape::cylinder(-1.0, 0.0, 1.0, Fit::Area),
        Shape::cylinder(f64::NAN, 0.0, 1.0, Fit::Area),
        Shape::cylinder(1.0, 1.0, 1.0, Fit::Area),
        Shape::cuboid(DVec3::ONE, DVec3::ZERO),
        Shape::rounded_plate(DVec2::ONE, 0.6, 0.0, 1.0),
    ] {
        let error = shape.triangulate("thing", chord(0.1)).unwrap_err();
        assert!(error.to_string().starts_with("thing: "), "{error}");
    }
    let cube =
        Solid::from_mesh(&Shape::cuboid(DVec3::ZERO, DVec3::ONE).triangulate("a", chord(0.1)).unwrap())
            .unwrap();
    let bigger = Shape::cuboid(-DVec3::ONE, DVec3::splat(2.0)).triangulate("b", chord(0.1)).unwrap();
    assert_eq!(
        cube.difference(&Solid::from_mesh(&bigger).unwrap()).unwrap_err(),
        MeshError::Empty { operation: "difference" }
    );
    assert!(matches!(Solid::union(vec![]), Err(MeshError::Empty { .. })));
    assert!(matches!(
        Solid::from_mesh(&TriMesh { vertices_mm: vec![DVec3::NAN; 4], triangles: vec![[0, 1, 2]; 4] }),
        Err(MeshError::Kernel { .. })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Inclusion and exclusion: |A| + |B| = |A u B| + |A n B|.
    #[test]
    fn booleans_conserve_volume(x in -3.0..3.0_f64, y in -3.0..3.0_f64, z in -3.0..3.0_f64, r in 0.3..4.0_f64, tilt in -1.5..1.5_f64) {
        let plate = Solid::from_mesh(&Shape::cuboid(DVec3::splat(-2.0), DVec3::splat(2.0)).triangulate("a", chord(0.05)).unwrap()).unwrap();
        let pose = DAffine3::from_rotation_x(tilt);
        let pose = DAffine3::from_translation(DVec3::new(x, y, z)) * pose;
        let rod = Piece::new("rod", Shape::cylinder(r, -1.0, 1.5, Fit::Area)).placed(pose).solid(chord(0.05)).unwrap();
        let both = Solid::union(vec![plate.clone(), rod.clone()]).unwrap();
        let shared = plate.intersection(&rod).unwrap().map_or(0.0, |s| s.volume_mm3());
        let sum = plate.volume_mm3() + rod.volume_mm3();
        prop_assert!((both.volume_mm3() + shared - sum).abs() < 1e-9 * sum);
    }
}

/// Against every triangle in turn, without the tree.
#[test]
fn rays_and_boxes_find_what_a_look_at_every_triangle_finds() {
    let mesh = dome(Fit::Area).triangulate("dome", chord(0.05)).unwrap();
    let target = RayTarget::new(&mesh);
    let alone: Vec<(RayTarget, BoundingBox)> = mesh
        .iter_mm()
        .map(|corners| {
            let one = TriMesh { vertices_mm: corners.to_vec(), triangles: vec![[0, 1, 2]] };
            (RayTarget::new(&one), BoundingBox::of(&corners).unwrap())
        })
        .collect();
    let mut seed = 7_u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1_u32 << 24)
    };
    let mut point = || DVec3::new(random(), random(), random()) * 26.0 - DVec3::new(13.0, 13.0, 14.0);
    let (mut hits, mut near) = (0, 0);
    for _ in 0..300 {
        let (from, to) = (point(), point());
        let nearest = alone.iter().filter_map(|(one, _)| Some(one.first_hit(from, to)?.0)).reduce(f64::min);
        assert_eq!(target.first_hit(from, to).map(|(t, _)| t), nearest, "{from} {to}");
        assert_eq!(target.is_hit(from, to), nearest.is_some(), "{from} {to}");
        hits += usize::from(nearest.is_some());
        let bounds = BoundingBox::of(&[from, from.lerp(to, 0.1)]).unwrap();
        let touched = alone.iter().any(|(_, own)| !own.is_apart_from(&bounds));
        assert_eq!(target.comes_near(&bounds), touched, "{bounds:?}");
        near += usize::from(touched);
    }
    assert!(hits > 50 && (30..270).contains(&near), "{hits} {near}");
    let nothing = RayTarget::new(&TriMesh::default());
    assert!(!nothing.is_hit(DVec3::ZERO, DVec3::ONE) && nothing.first_hit(DVec3::ZERO, DVec3::ONE).is_none());
}

/// Domes cut from above and from below, a counterbore, a cone and a pin: every kind of revolved face, with the axis'
/// pole at either end.
#[test]
fn exact_solids_hold_every_kind_of_turned_feature() {
    let dome = |low: f64, high: f64, center_z_mm: f64, poles_low: bool| {
        let points = if poles_low { [(0.0, low), (3.0, high)] } else { [(3.0, low), (0.0, high)] };
        Shape::Turned {
            profile: Profile {
                points_mm: points.map(|(r, z)| DVec2::new(r, z)).to_vec(),
                edges: vec![ProfileEdge::Arc { center_z_mm }],
            },
            fit: Fit::Area,
        }
    };
    let turned = |points: &[(f64, f64)]| Shape::Turned { profile: Profile::lines(points), fit: Fit::Area };
    let plate = Shape::rounded_plate(DVec2::new(40.0, 20.0), 2.0, 0.0, 8.0);
    let part = Construction {
        added: vec![
            Piece::new("plate", plate),
            Piece::new("pin", turned(&[(1.0, 7.0), (1.0, 10.0), (0.5, 10.5)])).at(0.0, 7.0),
        ],
        cut: vec![
            Piece::new("dome from above", dome(5.0, 8.0, 8.0, true)).at(-14.0, 0.0),
            Piece::new("dome from below", dome(0.0, 3.0, 0.0, false)).at(14.0, 0.0),
            Piece::new("counterbore", turned(&[(1.0, -1.0), (1.0, 4.0), (2.0, 4.0), (2.0, 9.0)]))
                .at(-5.0, 0.0),
            Piece::new("countersink", turned(&[(1.0, -1.0), (1.0, 6.0), (3.0, 8.0)])).at(5.0, 0.0),
        ],
    };
    let solid = part.exact_solid().unwrap();
    let step = write_step(&solid, "it's").unwrap();
    assert_eq!(step.matches("=SPHERICAL_SURFACE(").count(), 2 * 3);
    assert_eq!(step.matches("=CONICAL_SURFACE(").count(), 2 * 3);
    assert_eq!(step.matches("=CYLINDRICAL_SURFACE(").count(), 4 + 4 * 3);
    assert_eq!(step.matches("'it''s'").count(), 4);
}
