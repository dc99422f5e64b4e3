//! The bricks against their own energy, and against small-strain elasticity.

use super::brick::{points, respond};
use super::*;
use crate::{Contact, Level, Solid};

fn silicone() -> Elastomer {
    Elastomer { dome_radius_mm: 10.0, young_mpa: 0.56, poisson: 0.49, friction: 0.0 }
}

/// Numbers without pattern in [-1, 1].
fn scatter(k: usize) -> f64 {
    (k as f64 * 12.9898).sin() * 43_758.547 % 1.0
}

fn skewed_brick() -> [DVec3; 8] {
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let mut k = 0;
    corners.map(|c| {
        k += 3;
        DVec3::from_array(c.map(f64::from)) + 0.1 * DVec3::new(scatter(k), scatter(k + 1), scatter(k + 2))
    })
}

#[test]
fn force_and_tangent_are_derivatives_of_the_energy() {
    let rest = points(&skewed_brick()).unwrap();
    let mut u: [DVec3; 8] =
        std::array::from_fn(|a| 0.15 * DVec3::new(scatter(50 + a), scatter(70 + a), scatter(90 + a)));
    let here = respond(&rest, &u, 0.2, 9.0, true).unwrap();
    let k = here.stiffness.unwrap();
    assert!((*k - k.transpose()).amax() < 1e-12 * k.amax(), "the tangent is symmetric");
    let h = 1e-5;
    for a in 0..8 {
        for axis in 0..3 {
            u[a][axis] += h;
            let up = respond(&rest, &u, 0.2, 9.0, false).unwrap();
            u[a][axis] -= 2.0 * h;
            let down = respond(&rest, &u, 0.2, 9.0, false).unwrap();
            u[a][axis] += h;
            let slope = (up.energy - down.energy) / (2.0 * h);
            assert!(
                (slope - here.force[a][axis]).abs() < 1e-7,
                "{a} {axis}: {slope} {}",
                here.force[a][axis]
            );
            for b in 0..8 {
                for other in 0..3 {
                    let slope = (up.force[b][other] - down.force[b][other]) / (2.0 * h);
                    let exact = k[(3 * b + other, 3 * a + axis)];
                    assert!((slope - exact).abs() < 1e-6 * k.amax(), "{slope} {exact}");
                }
            }
        }
    }
}

#[test]
fn a_turn_of_the_whole_brick_costs_nothing() {
    let rest = skewed_brick();
    let turn = domecast_optics::numeric::rotation_from_vector(DVec3::new(0.4, -1.1, 0.7));
    let u = rest.map(|x| turn * x - x + DVec3::new(3.0, -2.0, 1.0));
    let response = respond(&points(&rest).unwrap(), &u, 0.2, 9.0, false).unwrap();
    assert!(response.energy.abs() < 1e-12);
    assert!(response.force.iter().all(|f| f.length() < 1e-12));
}

#[test]
fn an_even_stretch_has_its_exact_stress() {
    // Patch: a linear displacement has the same stress in every skewed brick; its forces balance those on a cut.
    let rest = skewed_brick();
    let stretch = DVec3::new(1.2, 0.9, 1.05);
    let u = rest.map(|x| x * stretch - x);
    let points = points(&rest).unwrap();
    let (shear, bulk) = (0.2, 9.0);
    let response = respond(&points, &u, shear, bulk, false).unwrap();
    let volume: f64 = points.iter().map(|p| p.1).sum();
    let j: f64 = stretch.x * stretch.y * stretch.z;
    let squares = stretch * stretch;
    let trace = squares.x + squares.y + squares.z;
    let energy =
        0.5 * shear * (j.powf(-2.0 / 3.0) * trace - 3.0) + 0.5 * bulk * (0.5 * (j * j - 1.0) - j.ln());
    assert!((response.energy - volume * energy).abs() < 1e-12 * volume * energy);
    // Virtual work of the same stretch rate: sum f.x = V P:I per axis.
    for axis in 0..3 {
        let work: f64 = response.force.iter().zip(&rest).map(|(f, x)| f[axis] * x[axis]).sum();
        let pressure = 0.5 * bulk * (j - 1.0 / j);
        let stress = shear * j.powf(-2.0 / 3.0) * (stretch[axis] - trace / (3.0 * stretch[axis]))
            + pressure * j / stretch[axis];
        assert!((work - volume * stress).abs() < 1e-10, "{work} {}", volume * stress);
    }
}

#[test]
fn the_mesh_fills_the_dome() {
    for half in [2, 4, 6] {
        let body = Body::new(&silicone(), half).unwrap();
        let area: f64 = body.mesh.surface.iter().map(|s| s.2).sum();
        let exact = std::f64::consts::TAU * 100.0;
        assert!((area / exact - 1.0).abs() < 0.5 / (half * half) as f64, "{half}: {area}");
        // Every surface node is found again where it lies, alone.
        for (number, (_, node, _)) in body.mesh.surface.iter().enumerate() {
            let found = body.mesh.surround(body.mesh.nodes_mm[*node as usize]);
            let weight: f64 = found.iter().filter(|f| f.0 == number).map(|f| f.1).sum();
            assert!((weight - 1.0).abs() < 1e-9, "{number} {found:?}");
        }
    }
}

/// Reference and small-strain forces and pole displacements differ by a part that shrinks with the depth.
#[test]
fn small_loads_agree_with_small_strain_to_first_order() {
    let elastomer = silicone();
    let body = Arc::new(Body::new(&elastomer, 5).unwrap());
    let plate = Indenter::rigid(Solid::cuboid(DVec3::new(30.0, 30.0, 4.0)).unwrap());
    let mut parts = Vec::new();
    for depth_mm in [0.8, 0.4, 0.2] {
        let pose = Rigid::from_translation(DVec3::Z * (12.0 - depth_mm));
        let solve = |small| neo_hookean(&elastomer, &body, &plate, &pose, None, small).unwrap();
        let (large, small) = (solve(false), solve(true));
        assert_eq!(large.status, Status::Solved);
        parts.push((large.wrench.force_n.z / small.wrench.force_n.z - 1.0).abs());
    }
    assert!(parts[0] < 0.1 && parts[1] < 0.75 * parts[0] && parts[2] < 0.75 * parts[1], "{parts:?}");
}

/// Two discretisations that share nothing but the physics: bricks at small strain come nearer to the swept elements.
#[test]
fn bricks_come_nearer_to_the_swept_elements() {
    let elastomer = silicone();
    let ball = Indenter::rigid(Solid::sphere(40.0).unwrap());
    let pose = Rigid::from_translation(DVec3::Z * (50.0 - 0.8));
    let swept = Contact::new(elastomer, Level::Linear { element_mm: 0.5 })
        .unwrap()
        .solve(&ball, &pose, None)
        .unwrap();
    let mut off = Vec::new();
    for half in [4, 8] {
        let body = Arc::new(Body::new(&elastomer, half).unwrap());
        let bricks = neo_hookean(&elastomer, &body, &ball, &pose, None, true).unwrap();
        let worst = [0.3_f64, 0.5, 0.8, 1.1]
            .map(|polar| DVec3::new(polar.sin(), 0.0, polar.cos()) * 10.0)
            .map(|at| bricks.displacement_mm(at).distance(swept.displacement_mm(at)))
            .into_iter()
            .fold(0.0, f64::max);
        let force = bricks.wrench.force_n.z / swept.wrench.force_n.z - 1.0;
        off.push((force.abs(), worst));
    }
    assert!(off[1].0 < 0.1 && off[1].1 < 0.05, "{off:?}");
    assert!(off[1].1 < off[0].1, "{off:?}");
}
