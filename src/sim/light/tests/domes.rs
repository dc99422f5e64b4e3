//! The light on a cap, and on a hemisphere on a cylinder.

use domecast_optics::DomeShape;

use super::tables::ways_of;
use super::*;

fn shapes() -> [DomeShape; 4] {
    [
        DomeShape::cap(11.5, 60_f64.to_radians()),
        DomeShape::cap(20.0, 30_f64.to_radians()),
        DomeShape::on_cylinder(10.0, 2.0),
        DomeShape::on_cylinder(6.0, 6.0),
    ]
}

fn over(dome: DomeShape, sheet: &[f64], fill: f64) -> SensorOptics {
    let flat = sensor(sheet, fill);
    flat.rebuilt(&OpticsSpec { dome, ..flat.spec() }).unwrap()
}

/// Places spread evenly over the area.
fn places(face: DomeFace, count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        face.place(2.399_963_229_728_653 * i as f64, face.level((i as f64 + 0.5) / count as f64))
    })
}

#[test]
fn the_map_goes_both_ways_and_keeps_areas() {
    for dome in shapes() {
        let face = DomeFace::of(&dome);
        for place in places(face, 400) {
            let disc = face.disc(place);
            assert!(disc.length() <= 1.0);
            assert!((face.place_of_disc(disc) - place).length() < 1e-12, "{dome:?} {place}");
            assert!((disc.length_squared() - (1.0 - place.z) / (1.0 - face.rim)).abs() < 1e-12);
            let (point, normal) = (dome.center_mm() + place * dome.radius_mm(), face.normal(place));
            assert!(dome.distance_mm(point).abs() < 1e-12 && point.z > -1e-12);
            assert!((dome.normal(point) - normal).length() < 1e-12);
        }
    }
}

#[test]
fn a_dome_keeps_what_its_base_does_not_take() {
    for dome in shapes() {
        let usual = Rings::usual(DomeFace::of(&dome));
        let fine = Rings { rings: 32, patches: 80, ..usual };
        let share = |sheet: &[f64], rings: Rings, underside| {
            let room = DomeRoom::new(&over(dome, sheet, 1.41), rings, underside);
            room.irradiance(&vec![1.0; rings.count()]).iter().sum::<f64>() / rings.count() as f64
        };
        let mean = |underside| share(&[], usual, underside);
        // All of the base's light, were it as bright, would reach the dome; by reciprocity the dome gives it its area.
        let base = dome.rim_radius_mm().powi(2) * PI;
        let expected = 1.0 - base / dome.area_mm2();
        assert!((mean(Underside::Dark) / expected - 1.0).abs() < 5e-3, "{dome:?} {}", mean(Underside::Dark));
        // With a mirror for a base nothing is lost. A cap and its image meet in an edge, which the patches only follow
        // as closely as they are fine.
        let (off, left) = (mean(Underside::Perfect) - 1.0, share(&[], fine, Underside::Perfect) - 1.0);
        assert!(left.abs() < 0.7 * off.abs() + 1e-2, "{dome:?} {off} {left}");
        // Over a real sheet there is no such edge.
        let (rough, better) =
            (share(&[1.494], usual, Underside::Fresnel), share(&[1.494], fine, Underside::Fresnel));
        assert!((rough / better - 1.0).abs() < 1e-2 && better < 1.0, "{dome:?} {rough} {better}");
    }
}

#[test]
fn the_table_matches_lamberts_contour_integral() {
    let parts = FieldParts { falloff: true, albedo: None, moved: false };
    for dome in shapes() {
        let optics = over(dome, &[1.0], 1.0);
        let source = emitter(DVec3::new(2.0, -1.5, -3.3), DVec3::new(-0.2, 0.1, 1.0), 1.0, 1.0);
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
            .map(|(x, y)| source.platform_from_emitter.transform_point3(DVec3::new(x, y, 0.0)));
        let (at, facing) =
            (source.platform_from_emitter.translation, source.platform_from_emitter.matrix3.z_axis);
        let field = LightField::new(&ways_of(&optics, source), &Prepared::default(), &parts);
        let (brightest, face) = (field.brightest()[0], DomeFace::of(&dome));
        let mut compared = 0;
        for place in places(face, 400) {
            let point = dome.center_mm() + place * dome.radius_mm();
            let way = point - at;
            let foot = (at + way * (-at.z / way.z)).truncate().length();
            // The light's own edge and the rim of its foot are no smooth matter.
            let clear =
                corners.iter().all(|c| (point - *c).dot(facing) > 0.5) && foot < dome.rim_radius_mm() - 1.5;
            if !clear {
                continue;
            }
            compared += 1;
            let exact = lambert_polygon(&corners, 1.0 / PI, point, -face.normal(place));
            let found = f64::from(field.still(place.as_vec3a())[0]);
            assert!((found - exact).abs() < 1e-2 * brightest, "{dome:?} {place}: {found} {exact}");
        }
        assert!(compared > 200, "{dome:?} {compared}");
    }
}

#[test]
fn light_that_comes_up_beside_a_cap_does_not_light_it() {
    let dome = DomeShape::cap(11.5, 60_f64.to_radians());
    let optics = over(dome, &[1.0], 1.0);
    let rule = EmitterRule::default();
    // Outside the foot, and aimed at the near flank: the ray would have to enter through the dome's side.
    let at = DVec3::new(14.0, 0.0, -3.0);
    let face = DomeFace::of(&dome);
    let place = face.place(0.0, face.level(0.2));
    let point = dome.center_mm() + place * dome.radius_mm();
    let ways = ways_of(&optics, emitter(at, point - at, 0.2, 1.0));
    assert_eq!(ways.flux(&ways.sources[0], point, &rule), DVec3::ZERO);
}
