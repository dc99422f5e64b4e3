//! Contact against closed forms and itself.

use glam::DVec3;

use super::*;

fn silicone() -> Elastomer {
    Elastomer { dome_radius_mm: 10.0, young_mpa: 0.56, poisson: 0.49, friction: 0.6 }
}

fn above(z_mm: f64) -> Rigid {
    Rigid::from_translation(DVec3::new(0.0, 0.0, z_mm))
}

#[test]
fn a_ball_on_the_pole_gives_a_force() {
    let ball = Indenter::rigid(Solid::sphere(5.0).unwrap());
    for level in [Level::Geometric, Level::ClosedForm] {
        let contact = Contact::new(silicone(), level).unwrap();
        let state = contact.solve(&ball, &above(14.5), None).unwrap();
        let hertz = 4.0 / 3.0 * silicone().plane_strain_mpa() * (10.0_f64 / 3.0).sqrt() * 0.5_f64.powf(1.5);
        println!("{level:?} {state:?} {hertz}");
    }
}

fn suspension() -> crate::mechanics::Suspension {
    let text = std::fs::read_to_string("designs/thumb24.json").unwrap();
    let design = crate::design::from_text(&text).unwrap();
    crate::mechanics::suspension_of(&design).unwrap()
}

#[test]
fn a_press_balances() {
    let suspension = suspension();
    for solid in [Solid::sphere(5.0).unwrap(), Solid::cuboid(DVec3::splat(12.0)).unwrap()] {
        let object = Indenter::rigid(solid);
        for level in [Level::Geometric, Level::ClosedForm] {
            let contact = Contact::new(silicone(), level).unwrap();
            let mut before: Option<Pressed> = None;
            for (frame, x) in [0.0, 1.0, 3.0].into_iter().enumerate() {
                let mut pose = above(20.0);
                pose.translation_mm.x = x;
                let began = std::time::Instant::now();
                let pressed = contact
                    .press_with_force(&object, &suspension, &pose, -DVec3::Z, 3.0, before.as_ref())
                    .unwrap();
                println!(
                    "{level:?} {frame} {:?} {} {:?} {:?} {:?}",
                    pressed.status,
                    pressed.iterations,
                    pressed.residual_n,
                    pressed.wrench,
                    began.elapsed()
                );
                let again =
                    contact.press(&object, &suspension, &pressed.rest_from_object, before.as_ref()).unwrap();
                println!(
                    "   {:?} {} {:?} {:?}",
                    again.status, again.iterations, again.residual_n, again.wrench
                );
                before = Some(pressed);
            }
        }
    }
}
