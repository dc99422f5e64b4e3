//! From a design to the numbers of its light.

use serde_json::json;

use super::crescents::{COLORS, crescents};
use super::numbers::{
    DotContrast, IlluminationReport, LightEvenness, LightsSeen, Percentiles, Places, Within,
};
use crate::light::{LightReport, lacking, normal_error_deg, percentile_of, scene};
use domecast_design::{Design, DesignError};
use domecast_sim::light::illumination::{IlluminatedPlace, Illumination, PlaceGrid, reflections};
use domecast_sim::light::separation::condition_number;
use domecast_sim::{Scene, SimError};

/// Polar angles to which statistics are taken, degrees.
pub const POLAR_ANGLES_DEG: [f64; 3] = [45.0, 60.0, 75.0];

/// Places over the dome: cells of some 2 by 4 degrees at a hemisphere's half height.
pub const GRID: PlaceGrid = PlaceGrid { rings: 48, places: 96 };

/// Grey levels at full scale.
const FULL: f64 = 255.0;

/// The numbers, and the light that they are of.
pub(super) fn measure(design: &Design) -> Result<(IlluminationReport, Illumination), DesignError> {
    require_colors(design)?;
    let checked = LightReport::of(design)?;
    let exposure = &design.sections().exposure;
    let scene = scene(design, checked.level_per_mw_mm2, exposure.stray_level)?;
    let light = Illumination::of(&scene, GRID).map_err(fault)?;
    let light = light.ok_or_else(|| {
        DesignError::at(
            "leds.list",
            json!([]),
            "the design has no lights",
            "at least one light of each colour",
        )
    })?;
    let lacks = lacking(&light, 75.0);
    let places = places(&light, &checked, FULL * exposure.stray_level, &lacks);
    let within = POLAR_ANGLES_DEG.map(|polar_deg| within(&light, &places, polar_deg)).into();
    let ink_reflectance = scene.file().ink.reflectance;
    // Light from outside is taken to fall on the lens, not on the dots.
    let contrast = |level: f64| (1.0 - ink_reflectance) * (level - FULL * exposure.stray_level);
    let rows = light.crosstalk.transpose();
    let report = IlluminationReport {
        version: 1,
        design: design.name().to_owned(),
        domecast: env!("CARGO_PKG_VERSION"),
        level_per_mw_mm2: checked.level_per_mw_mm2,
        is_exposure_at_limit: checked.is_exposure_at_limit,
        stray_levels: FULL * exposure.stray_level,
        crosstalk: [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.to_array()),
        within,
        crescents: crescents(&light, &lacks),
        lights_seen: lights_seen(&scene)?,
        dots: DotContrast {
            ink_reflectance,
            p5_levels: contrast(checked.dome.percentile_5_level),
            p50_levels: contrast(checked.dome.median_level),
            p95_levels: contrast(checked.dome.percentile_95_level),
        },
        dome: checked.dome,
        markers: checked.markers,
        places,
    };
    Ok((report, light))
}

/// What the simulator refuses is a fault of the design: of its lights, as a rule.
fn fault(error: SimError) -> DesignError {
    match error {
        SimError::Input(error) => *error,
        other => DesignError::at("leds", "", other.to_string(), "lights that can be computed"),
    }
}

/// Refuses lights without one of the colours: normals want three.
pub(super) fn require_colors(design: &Design) -> Result<(), DesignError> {
    use domecast_design::sections::LedColor;
    let leds = &design.sections().leds;
    if leds.list.is_empty() {
        // The check of the light names it, with a cure.
        return Ok(());
    }
    let wanted = [(LedColor::Red, "r"), (LedColor::Green, "g"), (LedColor::Blue, "b")];
    let fluxes = leds.radiant_flux_mw.to_array();
    for (((color, field), name), flux_mw) in wanted.into_iter().zip(COLORS).zip(fluxes) {
        if !leds.list.iter().any(|led| led.color == color || led.color == LedColor::White) {
            return Err(DesignError::at(
                "leds.list",
                json!(leds.list),
                format!("there is no {name} light: colours tell normals only where there are three"),
                "at least one light of each colour: red, green, blue",
            )
            .with_help(format!("add a light of colour {name}, best 120 degrees from the others")));
        }
        if flux_mw <= 0.0 {
            return Err(DesignError::at(
                format!("leds.radiant_flux_mw.{field}"),
                flux_mw,
                format!("the {name} lights send nothing: colours tell normals only where there are three"),
                "a radiant flux above 0 of each colour",
            )
            .with_help("give the colour the flux of the others"));
        }
    }
    Ok(())
}

fn places(light: &Illumination, checked: &LightReport, stray_levels: f64, lacks: &[[bool; 3]]) -> Places {
    let exposure = checked.level_per_mw_mm2;
    let each = light.places.iter();
    let grey = |place: &IlluminatedPlace| -> [f64; 3] {
        std::array::from_fn(|c| light.grey_per_mw_mm2(place, c, exposure))
    };
    let level = |place: &IlluminatedPlace| {
        let grey = grey(place);
        place.image_px.map(|_| std::array::from_fn(|c| grey[c] * place.total_mw_mm2[c] + stray_levels))
    };
    let error =
        |place: &IlluminatedPlace| place.image_px.and_then(|_| normal_error_deg(light, place, exposure));
    Places {
        rings: light.grid.rings,
        per_ring: light.grid.places,
        polar_deg: each.clone().map(|place| place.polar_deg).collect(),
        azimuth_deg: each.clone().map(|place| place.azimuth_deg).collect(),
        normal: each.clone().map(|place| place.normal.to_array()).collect(),
        image_px: each.clone().map(|place| place.image_px.map(|px| px.to_array())).collect(),
        vector_irradiance_mw_mm2: each
            .clone()
            .map(|place| place.vector_mw_mm2.map(|vector| vector.to_array()))
            .collect(),
        total_irradiance_mw_mm2: each.clone().map(|place| place.total_mw_mm2).collect(),
        grey_levels_per_mw_mm2: each.clone().map(grey).collect(),
        level: each.clone().map(level).collect(),
        condition_number: each.clone().map(|place| condition_number(&light.seen(place))).collect(),
        normal_error_deg_per_level: each.map(error).collect(),
        is_lacking: lacks.to_vec(),
    }
}

/// 95th percentile by area of the normal's error of the places seen from the pole to a polar angle, degrees a grey level.
pub(super) fn p95_to(report: &IlluminationReport, polar_angle_deg: f64) -> Option<f64> {
    let places = &report.places;
    let each = places.polar_deg.iter().zip(&places.image_px).zip(&places.normal_error_deg_per_level);
    let seen = each.filter(|((polar_deg, image_px), _)| **polar_deg <= polar_angle_deg && image_px.is_some());
    percentile_of(seen.map(|(_, error)| *error).collect(), 0.95)
}

fn within(light: &Illumination, places: &Places, polar_angle_deg: f64) -> Within {
    let inside: Vec<usize> =
        (0..light.places.len()).filter(|i| light.places[*i].polar_deg <= polar_angle_deg).collect();
    let seen: Vec<usize> = inside.iter().copied().filter(|i| places.image_px[*i].is_some()).collect();
    let lacks = lacking(light, polar_angle_deg);
    let share = |of: &[usize], wanted: &dyn Fn(usize) -> bool| {
        of.iter().filter(|i| wanted(**i)).count() as f64 / of.len().max(1) as f64
    };
    let percentiles = |of: &[usize], values: &[Option<f64>]| {
        percentiles(of.iter().map(|i| values.get(*i).copied().flatten()).collect())
    };
    Within {
        polar_angle_deg,
        places: inside.len(),
        places_seen: seen.len(),
        direct: evenness(&inside, &|i| light.places[i].direct_mw_mm2()),
        total: evenness(&inside, &|i| light.places[i].total_mw_mm2),
        condition_number: percentiles(&inside, &places.condition_number),
        normal_error_deg_per_level: percentiles(&seen, &places.normal_error_deg_per_level),
        crescent_share: share(&inside, &|i| lacks[i].contains(&true)),
        saturated_share: share(&seen, &|i| {
            places.level[i].is_some_and(|level| level.iter().any(|v| *v > FULL))
        }),
    }
}

pub(super) fn percentiles(values: Vec<Option<f64>>) -> Percentiles {
    let [p5, p50, p95] = [0.05, 0.5, 0.95].map(|part| percentile_of(values.clone(), part));
    Percentiles { p5, p50, p95 }
}

fn evenness(inside: &[usize], value: &dyn Fn(usize) -> [f64; 3]) -> LightEvenness {
    let values: Vec<[f64; 3]> = inside.iter().map(|i| value(*i)).collect();
    let irradiance_mw_mm2: [Percentiles; 3] =
        std::array::from_fn(|c| percentiles(values.iter().map(|v| Some(v[c])).collect()));
    let ratio =
        |of: Percentiles| of.p95.zip(of.p5).filter(|(_, low)| *low > 0.0).map(|(high, low)| high / low);
    let sums: Vec<f64> = values.iter().map(|v| v.iter().sum()).collect();
    LightEvenness {
        p95_over_p5: irradiance_mw_mm2.map(ratio),
        irradiance_mw_mm2,
        sum_coefficient_of_variation: coefficient_of_variation(&sums),
    }
}

/// Standard deviation over mean; `None` where all is dark.
pub(super) fn coefficient_of_variation(values: &[f64]) -> Option<f64> {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    (mean > 0.0).then(|| variance.sqrt() / mean)
}

fn lights_seen(scene: &Scene) -> Result<LightsSeen, DesignError> {
    let mirrored = reflections(scene).map_err(fault)?;
    let level = |one: &domecast_sim::light::illumination::Reflection| {
        FULL * one.level.iter().copied().map(f64::from).fold(0.0, f64::max)
    };
    let brightest = mirrored.iter().max_by(|a, b| level(a).total_cmp(&level(b)));
    Ok(LightsSeen {
        mirrored_pieces: mirrored.len(),
        brightest_mirrored_level: brightest.map(level),
        brightest_mirrored_px: brightest.map(|one| one.image_px.to_array()),
    })
}
