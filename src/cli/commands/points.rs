//! `domecast trace` and `domecast project`: points in, one JSON object a line out, in order.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use super::output::{Failure, Output};
use domecast_design::{DesignError, load_optics, parse_json, read_text, read_text_from};
use domecast_optics::numeric::Rigid;
use domecast_optics::{SensorOptics, SurfacePoint};

/// Rounding of a double, relative: what every coordinate that is read is off by.
const ROUNDING: f64 = f64::EPSILON / 2.0;
/// Standard deviation, px or mm, that rounding alone may give an answer. Beyond it the answer means nothing, and is none.
const MAX_ROUNDING_SD: f64 = 1e-3;

/// The status of an answer that rounding drowns.
const ILL_CONDITIONED: &str = "ill_conditioned";

/// Answers this many points at a time, so that output starts early and memory stays flat.
const CHUNK: usize = 4096;

/// Why a pixel or a point has no answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unseen {
    /// The name of the reason.
    pub status: &'static str,
    /// What rounding alone would give the answer, where that is the reason, mm or px.
    pub rounding_sd: Option<f64>,
}

impl Unseen {
    fn beyond(limit: &'static str) -> Self {
        Self { status: limit, rounding_sd: None }
    }

    /// Refuses what rounding alone would move too far.
    fn check(rounding_sd: f64) -> Result<f64, Self> {
        if rounding_sd.is_nan() || rounding_sd > MAX_ROUNDING_SD {
            let rounding_sd = Some(rounding_sd).filter(|sd| sd.is_finite());
            return Err(Self { status: ILL_CONDITIONED, rounding_sd });
        }
        Ok(rounding_sd)
    }
}

/// What a raw pixel sees on the dome, and the standard deviation that rounding alone gives it, mm.
///
/// # Errors
/// [`Unseen`]: beyond the lens or the dome, or drowned by rounding.
pub fn traced(optics: &SensorOptics, pixel: DVec2) -> Result<(SurfacePoint, f64), Unseen> {
    let spec = optics.lens().spec();
    let hit = optics.trace(pixel).map_err(|limit| Unseen::beyond(limit.as_str()))?;
    let by_pixel = optics.trace_with_jacobian(pixel).map_or(f64::NAN, |(_, by_pixel)| by_pixel.norm());
    let raster_px = DVec2::new(f64::from(spec.width), f64::from(spec.height));
    let sd_mm = ROUNDING * by_pixel * pixel.abs().max(raster_px).length();
    Ok((hit, Unseen::check(sd_mm)?))
}

/// The raw pixel that shows a point of the dome (sensor frame, mm), and the standard deviation that rounding alone gives it, px.
///
/// # Errors
/// [`Unseen`]: beyond the lens or the dome, or drowned by rounding.
pub fn projected(optics: &SensorOptics, place_mm: DVec3) -> Result<(DVec2, f64), Unseen> {
    let pixel = optics.project(place_mm).map_err(|limit| Unseen::beyond(limit.as_str()))?;
    let by_point = optics.project_with_jacobian(place_mm).map_or(f64::NAN, |(_, by_point)| by_point.norm());
    let sd_px = ROUNDING * by_point * place_mm.abs().max(DVec3::splat(optics.dome_radius_mm())).length();
    Ok((pixel, Unseen::check(sd_px)?))
}

/// `domecast trace DESIGN --pixels FILE|-`
pub fn trace(output: &Output, design: &Path, pixels: &Path, pose: Option<&Path>) -> Result<(), Failure> {
    let optics = optics(design, pose)?;
    let spec = optics.lens().spec();
    let (width, height) = (spec.width, spec.height);
    answer(output, pixels, ["u", "v"], |[u, v]| {
        let pixel = DVec2::new(u, v);
        let in_image = in_image_bounds(pixel, width, height);
        match traced(&optics, pixel) {
            Ok((hit, sd_mm)) => json!({
                "pixel": [u, v], "status": "ok",
                "surface_mm": hit.surface_mm.to_array(), "normal": hit.normal.to_array(),
                "field_angle_rad": hit.field_angle_rad, "in_image": in_image, "rounding_sd_mm": sd_mm,
            }),
            Err(Unseen { status, rounding_sd }) => json!({
                "pixel": finite([u, v]), "status": status, "surface_mm": null, "normal": null,
                "field_angle_rad": null, "in_image": in_image, "rounding_sd_mm": rounding_sd,
            }),
        }
    })
}

/// `domecast project DESIGN --points FILE|-`
pub fn project(output: &Output, design: &Path, points: &Path, pose: Option<&Path>) -> Result<(), Failure> {
    let optics = optics(design, pose)?;
    let spec = optics.lens().spec();
    let (width, height) = (spec.width, spec.height);
    answer(output, points, ["x", "y", "z"], |point| match projected(&optics, DVec3::from_array(point)) {
        Ok((pixel, sd_px)) => json!({
            "point_mm": point, "status": "ok", "image_px": pixel.to_array(),
            "in_image": in_image_bounds(pixel, width, height), "rounding_sd_px": sd_px,
        }),
        Err(Unseen { status, rounding_sd }) => json!({
            "point_mm": finite(point), "status": status, "image_px": null, "in_image": null,
            "rounding_sd_px": rounding_sd,
        }),
    })
}

/// Pixel centres are whole numbers, so the image reaches half a pixel beyond the first and the last.
fn in_image_bounds(pixel: DVec2, width: u32, height: u32) -> bool {
    let within = |value: f64, count: u32| value >= -0.5 && value < f64::from(count) - 0.5;
    within(pixel.x, width) && within(pixel.y, height)
}

/// JSON has no NaN: a coordinate that is not finite becomes null.
fn finite<const N: usize>(values: [f64; N]) -> Value {
    values.iter().map(|value| if value.is_finite() { json!(value) } else { Value::Null }).collect()
}

fn optics(design: &Path, pose: Option<&Path>) -> Result<SensorOptics, Failure> {
    let optics = load_optics(design)?;
    let Some(path) = pose else { return Ok(optics) };
    let value = parse_json(&read_text(path)?).map_err(|error| error.in_file(path))?;
    let allowed = "[[r,r,r,x],[r,r,r,y],[r,r,r,z],[0,0,0,1]]: a rotation, and a translation in mm";
    let fault = |problem: String| DesignError::at("pose", &value, problem, allowed).in_file(path);
    let rows: [[f64; 4]; 4] = serde_json::from_value(value.clone())
        .map_err(|error| fault(format!("this is not a 4x4 matrix ({error})")))?;
    let rest_from_platform = Rigid::from_rows_4x4(&rows).map_err(|error| fault(error.to_string()))?;
    Ok(optics.at_pose(&rest_from_platform).map_err(|error| fault(error.to_string()))?)
}

/// Reads the points and prints an answer for each. A row that holds no point is answered with the
/// status `malformed`, the rest goes on, and the first such row is the command's failure.
fn answer<const N: usize>(
    output: &Output,
    path: &Path,
    names: [&str; N],
    one: impl Fn([f64; N]) -> Value,
) -> Result<(), Failure> {
    let rows = read_rows(path, names)?;
    let mut first_bad = None;
    let mut text = String::new();
    for chunk in rows.chunks(CHUNK) {
        text.clear();
        for row in chunk {
            let value = match &row.point {
                Ok(point) => one(*point),
                Err(fault) => {
                    first_bad = first_bad.or(Some((row.line, fault)));
                    json!({ "line": row.line, "status": "malformed" })
                }
            };
            // writing to a String cannot fail
            let _ = writeln!(text, "{value}");
        }
        output.answer(&text)?;
    }
    match first_bad {
        None => Ok(()),
        Some((line, fault)) => {
            let mut error = DesignError::at("", "", fault.clone(), format!("numbers {}", names.join(",")));
            error.place = Some((line, 1));
            Err(error.in_file(path).into())
        }
    }
}

/// A row of the input: where it stands, and its point or what is wrong with it.
struct Row<const N: usize> {
    line: usize,
    point: Result<[f64; N], String>,
}

fn read_rows<const N: usize>(path: &Path, names: [&str; N]) -> Result<Vec<Row<N>>, DesignError> {
    let text = if path.as_os_str() == "-" {
        read_text_from(std::io::stdin()).map_err(|error| error.in_file(Path::new("standard input")))?
    } else {
        read_text(path)?
    };
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    if text.trim_start().starts_with(['[', '{']) {
        json_rows(text, names).map_err(|error| error.in_file(path))
    } else {
        let rows = csv_rows(text, names).map_err(|error| error.in_file(path))?;
        if rows.is_empty() {
            let allowed = format!("a row of {} for each point, or a JSON list", names.join(","));
            return Err(DesignError::at("", "", "holds no point", allowed).in_file(path));
        }
        Ok(rows)
    }
}

fn json_rows<const N: usize>(text: &str, names: [&str; N]) -> Result<Vec<Row<N>>, DesignError> {
    // Python writes NaN and Infinity into JSON; such a point has an answer ("not_finite"), so let it pass
    let text = text.replace("-Infinity", "null").replace("Infinity", "null").replace("NaN", "null");
    let value = parse_json(&text)?;
    let Value::Array(items) = &value else {
        return Err(DesignError::at(
            "",
            &value,
            "not a list of points",
            format!("a list of [{}]", names.join(",")),
        ));
    };
    let coordinate = |value: Option<&Value>| match value {
        Some(Value::Null) => Ok(f64::NAN),
        Some(Value::Number(number)) => Ok(number.as_f64().unwrap_or(f64::NAN)),
        _ => Err(()),
    };
    let point = |item: &Value| -> Result<[f64; N], ()> {
        let mut point = [0.0; N];
        for (index, name) in names.iter().enumerate() {
            point[index] = match item {
                Value::Array(list) if list.len() == N => coordinate(list.get(index))?,
                Value::Object(map) => coordinate(map.get(*name))?,
                _ => return Err(()),
            };
        }
        Ok(point)
    };
    let rows = items.iter().enumerate().map(|(index, item)| Row {
        line: index + 1,
        point: point(item).map_err(|()| format!("entry {} is {item}, not a point", index + 1)),
    });
    Ok(rows.collect())
}

fn csv_rows<const N: usize>(text: &str, names: [&str; N]) -> Result<Vec<Row<N>>, DesignError> {
    let mut columns: Option<[usize; N]> = None;
    let mut headerless = false;
    let mut rows = Vec::new();
    for (index, raw) in text.lines().enumerate() {
        let line = raw.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = line.split(',').map(|cell| cell.trim().trim_matches('"')).collect();
        let at = match columns {
            Some(at) => at,
            // the first row with anything in it may be a header
            None if names.iter().any(|name| cells.contains(name)) => {
                let mut at = [0; N];
                for (slot, name) in at.iter_mut().zip(names) {
                    *slot = cells.iter().position(|cell| cell == &name).ok_or_else(|| {
                        let mut fault = DesignError::at(
                            "",
                            "",
                            format!("the header has no column \"{name}\""),
                            names.join(","),
                        );
                        fault.place = Some((index + 1, 1));
                        fault
                    })?;
                }
                columns = Some(at);
                continue;
            }
            None => {
                headerless = true;
                let at = std::array::from_fn(|column| column);
                columns = Some(at);
                at
            }
        };
        if headerless && cells.len() != N {
            // without names, another number of columns is another kind of file
            let fault = format!("\"{line}\" has {} columns, not {N}", cells.len());
            rows.push(Row { line: index + 1, point: Err(fault) });
            continue;
        }
        rows.push(Row { line: index + 1, point: csv_point(&cells, at, names, line) });
    }
    Ok(rows)
}

fn csv_point<const N: usize>(
    cells: &[&str],
    at: [usize; N],
    names: [&str; N],
    line: &str,
) -> Result<[f64; N], String> {
    let mut point = [0.0; N];
    for ((slot, column), name) in point.iter_mut().zip(at).zip(names) {
        let cell = cells.get(column).copied().unwrap_or_default();
        *slot = cell.parse().map_err(|_| format!("\"{line}\" has no number for {name}"))?;
    }
    Ok(point)
}
