use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::checks;
use super::model::{LightModel, Number};
use super::observed::{SeenPress, depth_on_ball, touch_radius_mm};
use super::scatter::{Group, Scatter, likeliest};
use crate::constants::{DiffuserConstants, LedConstants, LightConstants, LightTolerances, LobeConstants};

fn led(color: &str, azimuth: f64) -> LedConstants {
    let out = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
    LedConstants {
        color: color.into(),
        position_mm: (out * 9.0 - DVec3::Z * 5.0).to_array(),
        axis: (-out).to_array(),
        across: DVec3::Z.to_array(),
        side_mm: 1.0,
        flux: 20.0,
        lobe: LobeConstants {
            exponent: 1.0,
            diffuser: Some(DiffuserConstants {
                lambert_fraction: 0.6,
                lobe_width_rad: 0.5,
                transmittance: 0.6,
            }),
        },
    }
}

fn light() -> LightConstants {
    LightConstants {
        leds: vec![led("red", 0.0), led("green", 2.0), led("blue", 4.0), led("red", 5.0)],
        crosstalk: [[1.0, 0.08, 0.08], [0.08, 1.0, 0.08], [0.08, 0.08, 1.0]],
        reflectance: [0.3; 3],
        mean_reflectance: [0.28; 3],
        stray: 0.005,
        gamma: 1.0,
        through_platform: 0.0,
        sheet_mm: [20.0, 20.0],
        hollows: Vec::new(),
        source: "nominal".into(),
        tolerances: LightTolerances::default(),
        sd: None,
        uncertainty: None,
    }
}

#[test]
fn numbers_stand_in_the_light_where_their_names_say() {
    let model = LightModel::new(&light());
    assert_eq!((model.bodies.len(), model.lobes.len()), (4, 1));
    assert_eq!(model.light(&vec![0.0; model.count()]), light());
    let values = |number: Number, value: f64| {
        let mut values = vec![0.0; model.count()];
        let at = model.numbers.iter().position(|own| *own == number).expect("a number");
        values[at] = value;
        values
    };
    let with = |number: Number, value: f64| model.light(&values(number, value));
    let written = |number: Number, value: f64| model.physical_light(&values(number, value));
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    assert!(near(with(Number::Flux(3), 1.0).leds[3].flux, 20.0 * 0.2_f64.exp()));
    assert!(near(with(Number::Place(0, 0), 1.0).leds[0].position_mm[0], 9.2));
    assert!(near(with(Number::Place(0, 1), 1.0).leds[0].position_mm[1], 0.2));
    assert!(near(with(Number::Place(0, 2), -1.0).leds[0].position_mm[2], -5.2));
    // Tilted, it looks up or down, and stays a frame.
    let tilted = &with(Number::Axis(1, 0), 1.0).leds[1];
    let axis = DVec3::from_array(tilted.axis);
    assert!(near(axis.dot(DVec3::from_array(light().leds[1].axis)), 0.04_f64.cos()) && axis.z.abs() > 0.03);
    assert!(axis.dot(DVec3::from_array(tilted.across)).abs() < 1e-12);
    assert!(with(Number::Axis(1, 1), 1.0).leds[1].axis[2].abs() < 1e-12);
    let tape = |light: &LightConstants| light.leds[2].lobe.diffuser.expect("a tape");
    assert!(near(tape(&with(Number::Lambert(0), 1.0)).lambert_fraction, 0.75));
    assert!(near(tape(&with(Number::Lambert(0), 9.0)).lambert_fraction, 1.0));
    // The fit may look beyond what can be; what is written may not.
    assert!(near(with(Number::Crosstalk(0, 2), -9.0).crosstalk[0][2], 0.08 - 0.18));
    assert!(near(written(Number::Crosstalk(0, 2), -9.0).crosstalk[0][2], 0.0));
    assert_eq!(written(Number::Flux(3), 1.0), with(Number::Flux(3), 1.0));
    let dark = with(Number::Reflectance(1), -1.0);
    assert!(near(dark.mean_reflectance[1] / 0.28, dark.reflectance[1] / 0.3));
    // No step leads to a light that the physics cannot take.
    assert!(with(Number::Reflectance(1), 99.0).mean_reflectance[1] <= 0.95);
    assert!(near(written(Number::Stray, -99.0).stray, 0.0));
}

#[test]
fn colours_of_a_white_light_are_one_body() {
    let mut nominal = light();
    nominal.leds = ["red", "green", "blue"].map(|color| led(color, 1.0)).to_vec();
    let model = LightModel::new(&nominal);
    assert_eq!((model.bodies.clone(), model.reshaped(Number::Place(0, 1)).len()), (vec![vec![0, 1, 2]], 3));
}

#[test]
fn rays_meet_the_near_side_of_the_ball() {
    let center = DVec3::new(0.0, 0.0, 13.6);
    let depth = depth_on_ball(DVec3::new(0.0, 0.0, 10.0), DVec3::Z, center, 4.0).expect("a hit");
    assert!((depth + 0.4).abs() < 1e-12);
    assert_eq!(depth_on_ball(DVec3::new(9.0, 0.0, 1.0), DVec3::Z, center, 4.0), None);
    // Hertz: a^2 = d R, with 1/R = 1/4 + 1/10.
    let touch = touch_radius_mm(center, 4.0, DVec3::ZERO, 10.0);
    assert!((touch * touch - 0.4 / 0.35).abs() < 1e-12);
    assert_eq!(touch_radius_mm(center * 2.0, 4.0, DVec3::ZERO, 10.0), 0.0);
}

#[test]
fn presses_that_are_alike_are_refused_with_where_to_press() {
    let press = |polar: f64, azimuth: f64| SeenPress {
        frame: 1,
        center_mm: 13.6 * DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()),
        depth_sd_mm: 0.03,
        gain: [1.0; 3],
    };
    let judge = |list: &[(f64, f64)]| {
        let presses: Vec<SeenPress> = list.iter().map(|(polar, azimuth)| press(*polar, *azimuth)).collect();
        checks::spread(&presses, DVec3::ZERO, 90.0)
    };
    judge(&[(0.0, 0.0), (0.4, 0.0), (0.4, 2.1), (0.4, 4.2), (0.7, 1.0)]).expect("far apart");
    for list in [[(0.0, 0.0); 5], [(0.0, 0.0), (0.5, 0.1), (0.2, 0.1), (0.7, 0.1), (0.4, 0.1)]] {
        let error = judge(&list).expect_err("alike");
        assert!(error.problem.contains("too similar") && error.cure.contains("50 degrees"), "{error}");
    }
    assert!(
        checks::input(4, 4.0).is_err()
            && checks::input(5, 0.0).is_err()
            && checks::input(5, f64::NAN).is_err()
    );
}

#[test]
fn errors_that_neighbours_share_are_found_and_count_once() {
    // A line of places whose levels share a smooth error of 2 % and have noise of a thousandth; one unknown, the level of all.
    let count = 40;
    let points_mm: Vec<DVec3> = (0..count).map(|i| DVec3::X * f64::from(i) * 0.5).collect();
    let group = |noise: f64| Group {
        rows: 0..3 * count as usize,
        points_mm: points_mm.clone(),
        levels: vec![DVec3::ONE; count as usize],
        noise: vec![DVec3::splat(noise); count as usize],
    };
    let truth = Scatter { common: 0.02, own: 3e-4, length_mm: 3.0, noise: 1.0 };
    let mut random = domecast_optics::numeric::SeededRandom::new(7);
    let white = DVector::from_fn(3 * count as usize, |_, _| random.normal());
    let own = group(1e-3);
    let off = own.factor(&truth).expect("a factor").l() * white;
    let slopes = DMatrix::from_element(3 * count as usize, 1, 1.0);
    let prior = (DMatrix::identity(1, 1), DVector::zeros(1));
    let start = Scatter { common: 0.001, own: 0.001, ..Scatter::first(1.0) };
    let found =
        likeliest(std::slice::from_ref(&own), start, [0.2, 20.0], &slopes, &off, (&prior.0, &prior.1));
    assert!((0.01..0.04).contains(&found.common) && found.own < 8e-3, "{found:?}");
    let sd = |scatter: &Scatter| {
        let said = own.says(&own.factor(scatter).expect("a factor"), &slopes, &off).expect("equations");
        said.matrix[(0, 0)].powf(-0.5)
    };
    // A hundred and twenty rows know the mean no better than some few independent ones would.
    assert!(sd(&found) > 0.004 && sd(&Scatter { common: 3e-4, own: 3e-4, ..found }) < 1e-3, "{}", sd(&found));
}

#[test]
fn presses_are_asked_for_until_they_are_enough_and_far_apart() {
    let mut taken: Vec<[f64; 2]> = Vec::new();
    while let Some(next) = checks::next_place(&taken, 90.0) {
        assert!(next[0] <= 50.0 + 1e-9 && taken.len() < 5, "{next:?}");
        taken.push(next);
    }
    assert_eq!((taken[0], taken.len()), ([0.0, 0.0], 5));
    // Five at one place are enough of none.
    let [polar, _] = checks::next_place(&[[10.0, 30.0]; 5], 90.0).expect("another place");
    assert!(polar > 40.0);
}
