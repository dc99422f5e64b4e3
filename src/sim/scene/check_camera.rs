//! Rules between the fields that say what real frames have besides.

use super::file::SceneFile;
use domecast_design::DesignError;

/// A gain of the first frame lies within the range of the others.
fn within(field: String, value: f64, [low, high]: [f64; 2]) -> Result<(), DesignError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let allowed = format!("{low} to {high}, the range of `gain` beside it");
    Err(DesignError::at(field, value, "the first gain is outside of the range of gains", allowed))
}

/// Pairs from small to large, pixels inside of the picture.
pub(super) fn check(file: &SceneFile, [width, height]: [u32; 2]) -> Result<(), DesignError> {
    let rises = |field: String, [low, high]: [f64; 2]| {
        if low <= high {
            return Ok(());
        }
        let value = serde_json::json!([low, high]);
        Err(DesignError::at(
            field,
            value,
            "the smallest comes first",
            format!("[a, b] with a at most b; here [{high}, {low}]"),
        ))
    };
    if let Some(dust) = &file.dust {
        for (index, lot) in dust.specks.iter().enumerate() {
            rises(format!("dust.specks[{index}].diameter_mm"), lot.diameter_mm)?;
        }
        for (index, lot) in dust.scratches.iter().enumerate() {
            rises(format!("dust.scratches[{index}].length_mm"), lot.length_mm)?;
        }
    }
    if let Some(section) = &file.electronics.auto_exposure {
        rises("electronics.auto_exposure.gain".into(), section.gain)?;
        within("electronics.auto_exposure.first_gain".into(), section.first_gain, section.gain)?;
    }
    if let Some(section) = &file.electronics.white_balance {
        rises("electronics.white_balance.gain".into(), section.gain)?;
        for (colour, first) in section.first.iter().enumerate() {
            within(format!("electronics.white_balance.first[{colour}]"), *first, section.gain)?;
        }
    }
    let Some(defects) = &file.electronics.defects else { return Ok(()) };
    rises("electronics.defects.hot_level".into(), defects.hot_level)?;
    for (list, name) in [(&defects.hot, "hot"), (&defects.dead, "dead")] {
        for (index, place) in list.iter().enumerate() {
            if place[0] >= width || place[1] >= height {
                return Err(DesignError::at(
                    format!("electronics.defects.{name}[{index}]"),
                    serde_json::json!(place),
                    "the pixel is outside of the picture",
                    format!("a column below {width} and a row below {height}"),
                ));
            }
        }
    }
    Ok(())
}
