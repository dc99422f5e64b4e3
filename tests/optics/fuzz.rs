//! Random lenses, stacks, pixels, rays and points against the reference.
//!
//! A fixed seed per lens makes every failure a one-line rerun: the message names
//! the seed, and `DOMECAST_FUZZ_SEED=seed` starts the test at it.

use std::f64::consts::PI;

use domecast::camera::{Lens, LensLimit, LensModel};
use domecast::numeric::SeededRandom;
use domecast::optics::{ColorChannel, RayLimit, SensorOptics};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::bounds::{EPS, Iterations, LAST, Seen, condition, pixel_ulps, ray_ulps, ulp};
use super::dd::{Dd, dd};
use super::random::{lens_spec, optics_spec};
use super::reference;
use super::reference_lens::{distance, field_angle, unit, v3};

/// One random lens and stack with everything that can be asked of them.
struct Run<'a> {
    seed: u64,
    optics: &'a SensorOptics,
    reference: reference::Sensor<'a>,
    end: f64,
    seen: Seen,
}

impl Run<'_> {
    fn lens(&self) -> &Lens {
        self.optics.lens()
    }

    fn direction(theta: f64, phi: f64) -> DVec3 {
        let (s, c) = theta.sin_cos();
        DVec3::new(s * phi.cos(), s * phi.sin(), c)
    }

    /// A ray that was found for a pixel is right: within 1e-10 rad of the
    /// reference, or within 8 ulp of the pixel times the condition there.
    fn ray_is_right(&self, pixel: DVec2, ray: DVec3, what: &str) {
        let seed = self.seed;
        assert!(ray.is_finite() && (ray.length() - 1.0).abs() < 4.0 * EPS, "seed {seed}: {what} {ray}");
        let theta = Lens::field_angle_rad(ray);
        assert!(theta <= self.end * (1.0 + 1e-13), "seed {seed}: {what}: {theta} past {}", self.end);
        if theta > self.end * (1.0 - LAST) {
            // The branch is the right one, since the domain is one-to-one.
            let [u, v] = self.reference.lens.pixel(v3(ray));
            let back = (u - dd(pixel.x)).f64().hypot((v - dd(pixel.y)).f64());
            let allowed = match self.lens().project_with_jacobian(ray) {
                Ok((_, slope)) => {
                    let by_lens = self.reference.lens.coefficient_ulps(ray);
                    ray_ulps(&slope, ray) + pixel_ulps(self.lens(), pixel) + by_lens
                }
                Err(limit) => panic!("seed {seed}: {what}: {limit} for {ray}"),
            };
            assert!(back <= allowed, "seed {seed}: {what}: pixel {pixel} maps {back:e} px off");
            return;
        }
        let Some(truth) = self.reference.lens.ray(pixel, self.end, Some(ray)) else {
            panic!("seed {seed}: {what}: no reference for pixel {pixel}, ray {ray}");
        };
        let error = distance(v3(ray), truth);
        if error > 1e-10 {
            let truth = DVec3::from_array(truth.map(Dd::f64));
            let slope = match self.lens().project_with_jacobian(truth) {
                Ok((_, slope)) => slope,
                Err(limit) => panic!("seed {seed}: {what}: {limit} for {truth}"),
            };
            let by_lens = self.reference.lens.coefficient_ulps(truth);
            let allowed = (pixel_ulps(self.lens(), pixel) + by_lens) * condition(&slope, 1.0);
            assert!(
                error <= allowed,
                "seed {seed}: {what}: pixel {pixel}, {error:e} rad, {allowed:e} allowed"
            );
        }
    }

    /// The image of the domain's rim, as a polygon about the pixel's own place.
    fn is_well_inside(&self, pixel: DVec2) -> bool {
        let [x, y] = self.reference.lens.image_of_pixel(pixel).map(Dd::f64);
        let (mut winding, mut nearest) = (0.0, f64::INFINITY);
        let n = 256;
        let at = |k: i32| {
            let ray = Self::direction(self.end * (1.0 - 1e-9), f64::from(k) * 2.0 * PI / f64::from(n));
            let [u, v] = self.reference.lens.image(v3(ray)).map(Dd::f64);
            DVec2::new(u - x, v - y)
        };
        let (mut a, mut largest) = (at(0), 0.0_f64);
        for k in 1..=n {
            let b = at(k);
            winding += a.perp_dot(b).atan2(a.dot(b));
            nearest = nearest.min(b.length());
            largest = largest.max((b - a).length());
            a = b;
        }
        winding.abs() > PI && nearest > largest
    }

    fn random_pixel(&mut self, r: &mut SeededRandom) {
        let [[fx, _, cx], [_, fy, cy], _] = self.lens().spec().matrix;
        let reach = (1.1 * self.lens().max_radius_px() / fx).min(30.0);
        let (radius, phi) = (reach * r.uniform(), r.between(-PI, PI));
        let pixel = match r.next_u64() % 32 {
            0 => DVec2::new(cx, cy),
            1 => DVec2::new(cx + 1e-12, cy - 1e-13),
            _ => DVec2::new(cx + fx * radius * phi.cos(), cy + fy * radius * phi.sin()),
        };
        self.pixel(pixel);
    }

    fn pixel(&mut self, pixel: DVec2) {
        let seed = self.seed;
        self.seen.checks += 1;
        match self.lens().unproject_solved(pixel) {
            Ok(found) => {
                self.seen.max.lens = self.seen.max.lens.max(found.iterations);
                assert_eq!(self.lens().unproject(pixel), Ok(found.ray), "seed {seed}");
                self.ray_is_right(pixel, found.ray, "unproject");
            }
            Err(limit) => {
                assert_eq!(limit, self.lens().end_limit(), "seed {seed}: pixel {pixel}");
                let tangential = {
                    let spec = self.lens().spec();
                    spec.model == LensModel::BrownConrady
                        && (spec.distortion[2], spec.distortion[3]) != (0.0, 0.0)
                };
                if tangential {
                    assert!(!self.is_well_inside(pixel), "seed {seed}: pixel {pixel} refused");
                } else {
                    let [x, y] = self.reference.lens.image_of_pixel(pixel);
                    let rho = (x * x + y * y).sqrt().f64();
                    let fisheye = self.lens().spec().model == LensModel::KannalaBrandt;
                    let rim = self.reference.lens.radius(dd(if fisheye { self.end } else { self.end.tan() }));
                    assert!(rho >= rim.f64() * (1.0 - 4.0 * EPS), "seed {seed}: pixel {pixel} refused");
                }
            }
        }
        self.traced(pixel);
    }

    fn traced(&mut self, pixel: DVec2) {
        let seed = self.seed;
        let hit = match self.optics.trace_with_jacobian(pixel) {
            Ok((hit, slope)) => {
                assert_eq!(self.optics.trace(pixel), Ok(hit), "seed {seed}");
                (hit, slope.norm())
            }
            Err(limit) => {
                assert_ne!(limit, RayLimit::NotConverged, "seed {seed}: pixel {pixel}");
                self.seen.limits += 1;
                if limit == RayLimit::MissesDome && self.optics.trace(pixel).is_err() {
                    let Ok(ray) = self.lens().unproject(pixel) else {
                        panic!("seed {seed}: {limit}");
                    };
                    let (hit, away) = self.reference.surface(v3(ray));
                    let radius = self.optics.dome_radius_mm();
                    assert!(
                        hit.is_none() || away > radius * (1.0 - 1e-9),
                        "seed {seed}: pixel {pixel} misses"
                    );
                }
                return;
            }
        };
        self.seen.ok += 1;
        let (hit, slope) = hit;
        let radius = self.optics.dome_radius_mm();
        assert!((hit.surface_mm.length() - radius).abs() <= 4.0 * EPS * radius, "seed {seed}");
        assert!(hit.surface_mm.z >= 0.0 && (hit.normal.length() - 1.0).abs() < 8.0 * EPS, "seed {seed}");
        if hit.field_angle_rad > self.end * (1.0 - 1e-6) {
            return;
        }
        let Some(ray) = self.reference.lens.ray(pixel, self.end, self.lens().unproject(pixel).ok()) else {
            panic!("seed {seed}: no reference for pixel {pixel}");
        };
        let (truth, away) = self.reference.surface(ray);
        let allowed = 1e-9 * radius + 64.0 * EPS * slope * (pixel.length() + self.lens().spec().matrix[0][0]);
        match truth {
            Some(truth) => {
                let error = distance(truth, v3(hit.surface_mm));
                assert!(error <= allowed, "seed {seed}: pixel {pixel}: {error:e} mm, {allowed:e} allowed");
            }
            None => assert!(away <= radius * (1.0 + 1e-9), "seed {seed}: pixel {pixel} hits past the rim"),
        }
        self.projected(hit.surface_mm, Some(pixel));
    }

    fn random_ray(&mut self, r: &mut SeededRandom) {
        let seed = self.seed;
        self.seen.checks += 1;
        let phi = r.between(-PI, PI);
        if r.next_u64().is_multiple_of(4) {
            // Past the end.
            let past = self.end * (1.0 + 1e-6) + (PI - self.end) * r.uniform().powi(4);
            if past < PI {
                let found = self.lens().project(Self::direction(past, phi));
                let wanted = [self.lens().end_limit(), LensLimit::BehindCamera];
                assert!(found.is_err_and(|l| wanted.contains(&l)), "seed {seed}: {found:?} at {past}");
                self.seen.limits += 1;
            }
            return;
        }
        let inside = match r.next_u64() % 4 {
            0 => 1.0 - LAST * (1.0 + 100.0 * r.uniform()),
            1 => r.uniform() * 1e-6,
            _ => r.uniform() * (1.0 - LAST),
        };
        let ray = Self::direction(self.end * inside, phi) * 10f64.powf(r.between(-3.0, 3.0));
        let [u, v] = self.reference.lens.pixel(v3(ray));
        let truth = DVec2::new(u.f64(), v.f64());
        let (pixel, slope) = match self.lens().project_with_jacobian(ray) {
            Ok(found) => found,
            Err(limit) => panic!("seed {seed}: {limit} at {inside} of the domain"),
        };
        assert_eq!(self.lens().project(ray), Ok(pixel), "seed {seed}");
        let error = (u - dd(pixel.x)).f64().hypot((v - dd(pixel.y)).f64());
        // Where the pixel is millions from the raster, its own ulp is the limit.
        let by_lens = self.reference.lens.coefficient_ulps(ray);
        let allowed = (ray_ulps(&slope, ray) + by_lens).max(8.0 * ulp(truth.length())).max(1e-9);
        assert!(error <= allowed, "seed {seed}: {pixel} is not {truth}: {error:e} px, {allowed:e} allowed");
        // And back, from our own pixel and from the true one.
        for pixel in [pixel, truth] {
            let back = match self.lens().unproject_solved(pixel) {
                Ok(back) => back,
                Err(limit) => panic!("seed {seed}: {limit} for {pixel} at {inside} of the domain"),
            };
            self.seen.max.lens = self.seen.max.lens.max(back.iterations);
            let error = distance(v3(back.ray), unit(v3(ray)));
            let allowed = (pixel_ulps(self.lens(), pixel) + by_lens) * condition(&slope, ray.length());
            assert!(
                error <= allowed.max(1e-10),
                "seed {seed}: {pixel} at {inside}: {error:e} rad, {allowed:e} allowed"
            );
            self.ray_is_right(pixel, back.ray, "back");
        }
        self.seen.ok += 1;
    }

    fn random_point(&mut self, r: &mut SeededRandom) {
        self.seen.checks += 1;
        let radius = self.optics.dome_radius_mm();
        let (phi, z) = (r.between(-PI, PI), r.uniform());
        let flat = (1.0 - z * z).sqrt();
        let on_dome = DVec3::new(flat * phi.cos(), flat * phi.sin(), z) * radius;
        let point = match r.next_u64() % 8 {
            0 => on_dome * r.uniform(),
            1 => DVec3::new(phi.cos(), phi.sin(), 0.0) * radius * r.between(0.0, 2.0),
            2 => DVec3::new(phi.cos(), phi.sin(), 0.0) * radius,
            3 => DVec3::new(0.0, 0.0, radius * r.uniform()),
            _ => on_dome,
        };
        self.projected(point, None);
    }

    /// `seen_by` is the pixel that traced to the point, if one did.
    fn projected(&mut self, point: DVec3, seen_by: Option<DVec2>) {
        let seed = self.seed;
        let found = self.optics.project_with_motion(point);
        let plain = self.optics.project(point);
        assert_ne!(plain, Err(RayLimit::NotConverged), "seed {seed}: point {point}");
        let theta = match self.reference.chief(v3(point), self.end) {
            Some(ray) => field_angle(ray).f64(),
            // No reference: total reflection, or a pupil that does not settle.
            None => f64::INFINITY,
        };
        let (pixel, motion) = match (plain, found) {
            (Ok(pixel), Ok(motion)) => (pixel, motion),
            (Err(limit), _) => {
                self.seen.limits += 1;
                let unsettled = !self.lens().is_central() && seen_by.is_none();
                assert!(
                    theta > self.end * (1.0 - 1e-6) || unsettled,
                    "seed {seed}: {limit} for {point} at {theta} of {}",
                    self.end
                );
                return;
            }
            (Ok(_), Err(limit)) => panic!("seed {seed}: no derivative at {point}: {limit}"),
        };
        self.seen.ok += 1;
        match self.optics.project_solved(point) {
            Ok(solved) => {
                assert_eq!(solved.pixel, pixel, "seed {seed}");
                self.seen.max.climb = self.seen.max.climb.max(solved.newton_iterations);
                self.seen.max.pupil = self.seen.max.pupil.max(solved.pupil_iterations);
            }
            Err(limit) => panic!("seed {seed}: {limit} at {point}"),
        }
        assert!(pixel.is_finite() && motion.pixel == pixel, "seed {seed}: {} is not {pixel}", motion.pixel);
        if theta > self.end * (1.0 - 1e-6) {
            assert!(
                theta <= self.end * (1.0 + 1e-6) || (theta.is_infinite() && !self.lens().is_central()),
                "seed {seed}: {point} is seen at {theta} past {}",
                self.end
            );
            return;
        }
        let ray = self.reference.chief(v3(point), self.end).unwrap();
        let [u, v] = self.reference.lens.pixel(ray);
        let truth = DVec2::new(u.f64(), v.f64());
        let reach = point.length() + self.optics.sensor_from_camera().translation_mm.length();
        let (by_point, by_pose) = (motion.by_point.norm(), motion.by_pose.norm());
        assert!(by_pose.is_finite(), "seed {seed}");
        // 8 ulp of all lengths that go in, times the slope.
        let by_lens = self.reference.lens.coefficient_ulps(DVec3::from_array(ray.map(Dd::f64)));
        let allowed = (8.0 * EPS * (by_point * reach + truth.length()) + by_lens).max(1e-9);
        let error = (pixel - truth).length();
        assert!(error <= allowed, "seed {seed}: point {point}: {error:e} px, {allowed:e} allowed");
        if let Some(pixel) = seen_by {
            let allowed = 4.0 * allowed + 64.0 * EPS * pixel.length();
            let error = (truth - pixel).length();
            // Near a fold one pixel ulp moves the point by many of its own.
            let fold = 1e-9 + 1e3 * EPS * by_point * reach;
            assert!(error <= allowed.max(fold), "seed {seed}: pixel {pixel} came back {error:e} px off");
        }
    }
}

fn run(seed: u64, per_lens: u64) -> Seen {
    let mut r = SeededRandom::new(seed);
    let lens = lens_spec(&mut r);
    let spec = optics_spec(&mut r, lens);
    let channel = ColorChannel::ALL[(r.next_u64() % 3) as usize];
    let optics = match SensorOptics::new(&spec) {
        Ok(optics) => optics.for_channel(channel),
        Err(error) => panic!("seed {seed}: {error}"),
    };
    let end = optics.lens().max_field_angle_rad();
    assert!(end > 0.0 && end.is_finite(), "seed {seed}");
    let mut run = Run {
        seed,
        optics: &optics,
        reference: reference::Sensor::new(&spec, &optics),
        end,
        seen: Seen { lenses: 1, ..Seen::default() },
    };
    // The reference takes directions as they are: a unit vector is needed only
    // where angles are compared.
    assert!((distance(unit([dd(0.0), dd(3.0), dd(4.0)]), [dd(0.0), dd(0.6), dd(0.8)])) < 1e-16);
    for k in 0..per_lens {
        match k % 3 {
            0 => run.random_pixel(&mut r),
            1 => run.random_ray(&mut r),
            _ => run.random_point(&mut r),
        }
    }
    run.seen
}

fn fuzz(lenses: u64, per_lens: u64, seed: u64) -> Seen {
    (0..lenses).into_par_iter().map(|i| run(seed + i, per_lens)).reduce(Seen::default, Seen::plus)
}

fn first_seed(default: u64) -> u64 {
    std::env::var("DOMECAST_FUZZ_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(default)
}

fn within_the_stated_iterations(max: &Iterations) {
    let stated = [
        (max.lens, Lens::MAX_UNPROJECT_ITERATIONS),
        (max.climb, SensorOptics::MAX_NEWTON_ITERATIONS),
        (max.pupil, SensorOptics::MAX_PUPIL_ITERATIONS),
    ];
    for (met, bound) in stated {
        assert!(met > 0 && met <= bound, "{met} iterations, {bound} stated");
    }
}

#[test]
fn random_optics_agree_with_the_reference() {
    let seen = fuzz(600, 24, first_seed(1));
    assert!(seen.ok > seen.checks / 4 && seen.limits > seen.checks / 20);
    within_the_stated_iterations(&seen.max);
}

#[test]
fn long_a_million_random_optics() {
    let seen = fuzz(42_000, 24, first_seed(1_000_000));
    assert!(seen.checks >= 1_000_000);
    within_the_stated_iterations(&seen.max);
}
