//! Tasks without an answer, distances, and points far away.

use super::*;

#[test]
fn unusable_tasks_have_named_errors() {
    let contact = Contact::new(silicone(), Level::Geometric).unwrap();
    let small = ball(2.0);
    let error = |pose: &Rigid| contact.solve(&small, pose, None).unwrap_err();
    assert!(matches!(
        error(&Rigid::from_translation(DVec3::new(11.0, 0.0, 1.0))),
        ContactError::InsideSheet { .. }
    ));
    assert!(matches!(error(&above(3.0)), ContactError::TooDeep { .. }));
    assert!(matches!(error(&above(f64::NAN)), ContactError::BadPose(_)));
    assert!(ContactSolid::sphere(-1.0).is_err() && ContactSolid::cuboid(DVec3::new(1.0, 0.0, 1.0)).is_err());
    assert!(Contact::new(Elastomer { poisson: 0.5, ..silicone() }, Level::Geometric).is_err());
    let fine = Level::Linear { element_mm: 1e-3 };
    assert!(matches!(Contact::new(silicone(), fine), Err(ContactError::TooFine { .. })));
    let open = TriMesh {
        vertices_mm: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3]],
    };
    assert!(matches!(ContactSolid::mesh(&open), Err(ContactError::OpenMesh { edges: 3 })));
    let mut closed = open.clone();
    closed.triangles.push([0, 3, 2]);
    assert!(ContactSolid::mesh(&closed).is_ok());
    let inside_out = TriMesh {
        triangles: closed.triangles.iter().map(|t| [t[0], t[2], t[1]]).collect(),
        ..closed.clone()
    };
    assert!(matches!(ContactSolid::mesh(&inside_out), Err(ContactError::InsideOut { .. })));
    let mut thick = closed.clone();
    thick.vertices_mm.push(DVec3::splat(2.0));
    thick.triangles.extend([[0, 1, 4], [1, 0, 4]]);
    assert!(matches!(ContactSolid::mesh(&thick), Err(ContactError::NotManifold { .. })));
    assert!(matches!(ContactSolid::mesh(&TriMesh::default()), Err(ContactError::EmptyMesh)));
}

#[test]
fn distances_are_distances() {
    let size = DVec3::new(3.0, 4.0, 6.0);
    let solids = [
        ContactSolid::sphere(2.0).unwrap(),
        ContactSolid::cylinder(1.5, 4.0).unwrap(),
        ContactSolid::cuboid(size).unwrap(),
        ContactSolid::cone(2.0, 3.0).unwrap(),
        ContactSolid::mesh(&box_mesh(size)).unwrap(),
    ];
    let scatter = |k: u32| (f64::from(k) * 12.9898).sin() * 43_758.547 % 1.0;
    for solid in &solids {
        let (center, reach) = solid.bounding_sphere();
        for k in 0..400 {
            let p = 5.0 * DVec3::new(scatter(3 * k), scatter(3 * k + 1), scatter(3 * k + 2));
            let found = solid.distance(p);
            assert!((found.outward.length() - 1.0).abs() < 1e-9);
            // Along its gradient the distance falls to zero, on the surface, within the bounding ball.
            let foot = p - found.outward * found.value_mm;
            assert!(solid.distance(foot).value_mm.abs() < 1e-9, "{solid:?} {p}");
            assert!(foot.distance(center) <= reach * (1.0 + 1e-9));
            let q = p + 0.3 * DVec3::new(scatter(k + 7), scatter(k + 9), scatter(k + 11));
            assert!((solid.distance(q).value_mm - found.value_mm).abs() <= q.distance(p) + 1e-12);
            let far = solid.support(p);
            assert!(solid.distance(far).value_mm.abs() < 1e-9);
            assert!(far.dot(p) >= foot.dot(p) - 1e-9);
        }
    }
    for k in 0..400 {
        let p = 5.0 * DVec3::new(scatter(k), scatter(k + 1000), scatter(k + 2000));
        assert!(
            (solids[2].distance(p).value_mm - solids[4].distance(p).value_mm).abs() < 1e-12,
            "a box is a box"
        );
    }
}

#[test]
fn no_point_moves_to_nowhere() {
    for level in [Level::Geometric, Level::ClosedForm, Level::Linear { element_mm: 2.0 }] {
        let contact = Contact::new(silicone(), level).unwrap();
        let state = contact.solve(&ball(4.0), &ball_at(4.0, 0.3, 0.9), None).unwrap();
        let mut points = dome_points(700);
        points.extend([
            DVec3::ZERO,
            DVec3::splat(f64::NAN),
            DVec3::X * 10.0,
            -DVec3::Z * 10.0,
            DVec3::Z * 1e300,
        ]);
        let one_by_one: Vec<DVec3> = points.iter().map(|p| state.displacement_mm(*p)).collect();
        assert!(one_by_one.iter().all(|u| u.is_finite()));
        let mut at_once = vec![DVec3::ZERO; points.len()];
        state.displacements_mm(&points, &mut at_once).unwrap();
        // The raster of many points interpolates along the ring.
        let worst = one_by_one.iter().zip(&at_once).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(worst < 2e-3, "{level:?} {worst}");
        let map = state.height_map_mm(&silicone().dome(), 31);
        assert!(map.iter().all(|h| h.is_finite()) && map.len() == 961);
        let extent = state.extent();
        for (p, u) in points.iter().zip(&one_by_one).take(700) {
            let outside = p.normalize().dot(extent.direction) < extent.angle_rad.cos() - 1e-9;
            assert!(!outside || u.length() <= extent.beyond_mm + 1e-12, "{level:?} {p} {u}");
        }
    }
}

#[test]
fn closed_forms_meet_each_other() {
    let (modulus, depth) = (0.7, 0.4);
    let round = half_space::ellipse(depth, [0.1, 0.1], modulus).unwrap();
    let nearly = half_space::ellipse(depth, [0.1, 0.1001], modulus).unwrap();
    assert!((round.a_mm - (depth / 0.2_f64).sqrt()).abs() < 1e-12, "a^2 = R d");
    assert!((round.force_n - 4.0 / 3.0 * modulus * 0.2 * round.a_mm.powi(3)).abs() < 1e-12);
    assert!((nearly.force_n / round.force_n - 1.0).abs() < 1e-3);
    let cone = half_space::cone(depth, 0.2, 0.0, modulus);
    assert!((cone.force_n - round.force_n).abs() < 1e-12 && (cone.a_mm - round.a_mm).abs() < 1e-12);
    for patch in [
        round,
        nearly,
        half_space::ellipse(depth, [0.05, 0.9], modulus).unwrap(),
        half_space::cone(depth, 0.2, 0.3, modulus),
    ] {
        // The sink is smooth across the edge, and a force's far field far away.
        for (x, y) in [(patch.a_mm, 0.0), (0.0, patch.b_mm)] {
            let (inner, outer) = (
                patch.sink_mm(x * (1.0 - 1e-9), y * (1.0 - 1e-9), modulus),
                patch.sink_mm(x * (1.0 + 1e-9), y * (1.0 + 1e-9), modulus),
            );
            assert!((inner - outer).abs() < 1e-4 * depth, "{inner} {outer}");
        }
        let far = 200.0 * patch.a_mm;
        let point = patch.force_n / (std::f64::consts::PI * modulus * far);
        assert!((patch.sink_mm(far, 0.0, modulus) / point - 1.0).abs() < 1e-3);
    }
}
