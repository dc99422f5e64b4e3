//! Two designs or two builds side by side: what changed in fields, dots, parts, loads and resolution.

mod side;
mod text;

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

pub use side::Side;

/// Everything that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Names of the two designs.
    pub names: [String; 2],
    /// Fields of the design that differ, in the file's order; reasons (`why`) are no difference.
    pub fields: Vec<Changed<Value>>,
    /// The dots.
    pub dots: DotsChanged,
    /// Parts whose volume or size differ, or that only one side has.
    pub parts: Vec<PartChanged>,
    /// Lines of the load envelope that differ.
    pub loads: Vec<Changed<String>>,
    /// Standard deviations of the wrench at rest, Fx .. Mz: N, N*mm.
    pub wrench_sd: Vec<Changed<f64>>,
    /// Largest difference of an element of the stiffness at rest, as a share of its diagonal.
    pub stiffness_share: Option<f64>,
}

/// A thing with a name and a value on either side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Changed<T> {
    /// What it is.
    pub name: String,
    /// On the first side, if it is there.
    pub a: Option<T>,
    /// On the second side, if it is there.
    pub b: Option<T>,
}

/// How the dots differ. Dots are paired by their places in the image: each with the nearest of the other side, if
/// that is mutual and nearer than half a pitch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DotsChanged {
    /// How many dots each side has.
    pub counts: [usize; 2],
    /// How many are paired.
    pub paired: usize,
    /// Mean and largest distance of a pair in the raw image, px.
    pub image_px: Option<[f64; 2]>,
    /// The same on the dome, mm.
    pub surface_mm: Option<[f64; 2]>,
    /// The same on the plate, mm.
    pub plate_mm: Option<[f64; 2]>,
    /// The same for the diameter on the dome, mm.
    pub diameter_mm: Option<[f64; 2]>,
}

/// How a part differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartChanged {
    /// Its name.
    pub name: String,
    /// Volumes, mm^3.
    pub volume_mm3: [Option<f64>; 2],
    /// Sizes along x, y, z, mm.
    pub size_mm: [Option<[f64; 3]>; 2],
}

/// Compares two sides.
pub fn compare(a: &Side, b: &Side) -> Comparison {
    let mut fields = Vec::new();
    let (flat_a, flat_b) = (flat(&a.design), flat(&b.design));
    let order: Vec<&String> = flat_a
        .iter()
        .map(|(path, _)| path)
        .chain(
            flat_b.iter().map(|(path, _)| path).filter(|path| flat_a.iter().all(|(other, _)| other != *path)),
        )
        .collect();
    let look = |list: &[(String, Value)], path: &str| {
        list.iter().find(|(other, _)| other == path).map(|(_, value)| value.clone())
    };
    for path in order {
        let (left, right) = (look(&flat_a, path), look(&flat_b, path));
        if !same(left.as_ref(), right.as_ref()) {
            fields.push(Changed { name: path.clone(), a: left, b: right });
        }
    }
    Comparison {
        names: [a.name(), b.name()],
        fields,
        dots: dots(a, b),
        parts: parts(a, b),
        loads: loads(a, b),
        wrench_sd: wrench_sd(a, b),
        stiffness_share: stiffness_share(a, b),
    }
}

/// 10 and 10.0 are the same number.
fn same(a: Option<&Value>, b: Option<&Value>) -> bool {
    match (a.and_then(Value::as_f64), b.and_then(Value::as_f64)) {
        (Some(a), Some(b)) => a == b,
        _ => a == b,
    }
}

/// Paths and values of all leaves but the reasons, in the file's order.
fn flat(design: &Value) -> Vec<(String, Value)> {
    fn walk(value: &Value, path: &str, out: &mut Vec<(String, Value)>) {
        match value {
            Value::Object(map) if !map.is_empty() => {
                for (key, below) in map.iter().filter(|(key, _)| *key != "why" && *key != "$schema") {
                    walk(below, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, out);
                }
            }
            Value::Array(items) if !items.is_empty() => {
                for (index, below) in items.iter().enumerate() {
                    walk(below, &format!("{path}[{index}]"), out);
                }
            }
            leaf => out.push((path.to_owned(), leaf.clone())),
        }
    }
    let mut out = Vec::new();
    walk(design, "", &mut out);
    out
}

fn numbers<const N: usize>(value: &Value, key: &str) -> Option<[f64; N]> {
    let list = value.get(key)?.as_array()?;
    let numbers: Vec<f64> = list.iter().filter_map(Value::as_f64).collect();
    numbers.try_into().ok()
}

fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn dots(a: &Side, b: &Side) -> DotsChanged {
    let list = |side: &Side| -> Vec<Value> {
        side.constants.get("black_dots").and_then(Value::as_array).cloned().unwrap_or_default()
    };
    let (left, right) = (list(a), list(b));
    let places = |dots: &[Value]| -> Vec<[f64; 2]> {
        dots.iter().map(|dot| numbers(dot, "image_px").unwrap_or([f64::NAN; 2])).collect()
    };
    let (from, to) = (places(&left), places(&right));
    let (grid_a, grid_b) = (Grid::new(&from), Grid::new(&to));
    let reach = 0.5 * grid_a.spacing().min(grid_b.spacing());
    let mut pairs = Vec::new();
    for (i, &point) in from.iter().enumerate() {
        let Some((j, gap)) = grid_b.nearest(point) else { continue };
        if gap <= reach && grid_a.nearest(to[j]).is_some_and(|(back, _)| back == i) {
            pairs.push((i, j));
        }
    }
    let spread = |gap: &dyn Fn(&Value, &Value) -> Option<f64>| {
        let gaps: Vec<f64> = pairs.iter().filter_map(|&(i, j)| gap(&left[i], &right[j])).collect();
        let largest = gaps.iter().copied().fold(0.0, f64::max);
        (!gaps.is_empty()).then(|| [gaps.iter().sum::<f64>() / gaps.len() as f64, largest])
    };
    DotsChanged {
        counts: [left.len(), right.len()],
        paired: pairs.len(),
        image_px: spread(&|p, q| Some(distance::<2>(numbers(p, "image_px")?, numbers(q, "image_px")?))),
        surface_mm: spread(&|p, q| Some(distance::<3>(numbers(p, "surface_mm")?, numbers(q, "surface_mm")?))),
        plate_mm: spread(&|p, q| Some(distance::<2>(numbers(p, "plate_mm")?, numbers(q, "plate_mm")?))),
        diameter_mm: spread(&|p, q| {
            Some((p.get("diameter_mm")?.as_f64()? - q.get("diameter_mm")?.as_f64()?).abs())
        }),
    }
}

/// Points sorted into cells, so that the nearest is found without looking at all of them.
struct Grid<'a> {
    points: &'a [[f64; 2]],
    cells: BTreeMap<(i64, i64), Vec<usize>>,
    side: f64,
}

impl<'a> Grid<'a> {
    fn new(points: &'a [[f64; 2]]) -> Self {
        let finite = || points.iter().filter(|p| p.iter().all(|v| v.is_finite()));
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in finite() {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let area = ((high[0] - low[0]) * (high[1] - low[1])).max(1.0);
        let side = if area.is_finite() { (area / points.len().max(1) as f64).sqrt() } else { 1.0 };
        let mut cells: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
        for (index, p) in points.iter().enumerate().filter(|(_, p)| p.iter().all(|v| v.is_finite())) {
            cells.entry(Self::cell(*p, side)).or_default().push(index);
        }
        Self { points, cells, side }
    }

    fn cell(p: [f64; 2], side: f64) -> (i64, i64) {
        ((p[0] / side).floor() as i64, (p[1] / side).floor() as i64)
    }

    /// About the pitch of the points, px.
    fn spacing(&self) -> f64 {
        self.side
    }

    /// The nearest point within one cell, and its distance.
    fn nearest(&self, p: [f64; 2]) -> Option<(usize, f64)> {
        let (x, y) = Self::cell(p, self.side);
        let around = (x - 1..=x + 1).flat_map(|i| (y - 1..=y + 1).map(move |j| (i, j)));
        around
            .filter_map(|cell| self.cells.get(&cell))
            .flatten()
            .map(|&index| (index, distance(p, self.points[index])))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
    }
}

fn parts(a: &Side, b: &Side) -> Vec<PartChanged> {
    let list = |side: &Side| -> BTreeMap<String, Value> {
        let parts = side.manifest.get("parts").and_then(Value::as_array).cloned().unwrap_or_default();
        parts.into_iter().filter_map(|part| Some((part.get("name")?.as_str()?.to_owned(), part))).collect()
    };
    let (left, right) = (list(a), list(b));
    let names: std::collections::BTreeSet<&String> = left.keys().chain(right.keys()).collect();
    let size = |part: &Value| {
        let corners = part.get("bbox_mm")?.as_array()?;
        let corner =
            |k: usize| corners.get(k).and_then(|c| numbers::<3>(&serde_json::json!({ "c": c }), "c"));
        let (low, high) = (corner(0)?, corner(1)?);
        Some([high[0] - low[0], high[1] - low[1], high[2] - low[2]])
    };
    names
        .into_iter()
        .map(|name| {
            let sides = [left.get(name), right.get(name)];
            PartChanged {
                name: name.clone(),
                volume_mm3: sides.map(|part| part?.get("volume_mm3")?.as_f64()),
                size_mm: sides.map(|part| part.and_then(size)),
            }
        })
        .filter(|part| part.volume_mm3[0] != part.volume_mm3[1] || part.size_mm[0] != part.size_mm[1])
        .collect()
}

fn loads(a: &Side, b: &Side) -> Vec<Changed<String>> {
    let list = |side: &Side| -> Vec<(String, String)> {
        let lines = side.forces.get("envelope").and_then(Value::as_array).cloned().unwrap_or_default();
        let told = |line: &Value| {
            let size = line.get("size")?.as_f64()?;
            let ended = line.get("ended_by")?.as_str()?.replace('_', " ");
            Some((line.get("load")?.as_str()?.to_owned(), format!("{size:.3} until {ended}")))
        };
        lines.iter().filter_map(told).collect()
    };
    let (left, right) = (list(a), list(b));
    let look = |list: &[(String, String)], name: &str| {
        list.iter().find(|(other, _)| other == name).map(|(_, text)| text.clone())
    };
    let names =
        left.iter().chain(right.iter().filter(|(name, _)| left.iter().all(|(other, _)| other != name)));
    names
        .map(|(name, _)| Changed { name: name.clone(), a: look(&left, name), b: look(&right, name) })
        .filter(|line| line.a != line.b)
        .collect()
}

fn wrench_sd(a: &Side, b: &Side) -> Vec<Changed<f64>> {
    let list = |side: &Side| side.forces.get("resolution_at_rest").and_then(|r| numbers::<6>(r, "wrench_sd"));
    let (left, right) = (list(a), list(b));
    ["Fx", "Fy", "Fz", "Mx", "My", "Mz"]
        .iter()
        .enumerate()
        .map(|(k, name)| Changed {
            name: (*name).to_owned(),
            a: left.map(|sd| sd[k]),
            b: right.map(|sd| sd[k]),
        })
        .filter(|sd| sd.a != sd.b)
        .collect()
}

fn stiffness_share(a: &Side, b: &Side) -> Option<f64> {
    let matrix = |side: &Side| -> Option<Vec<Vec<f64>>> {
        let rows = side.constants.pointer("/springs/stiffness")?.as_array()?;
        let rows: Vec<Vec<f64>> = rows
            .iter()
            .map(|row| {
                row.as_array().map_or_else(Vec::new, |row| row.iter().filter_map(Value::as_f64).collect())
            })
            .collect();
        (rows.len() == 6 && rows.iter().all(|row| row.len() == 6)).then_some(rows)
    };
    let (left, right) = (matrix(a)?, matrix(b)?);
    let mut worst = 0.0f64;
    for i in 0..6 {
        for j in 0..6 {
            let scale = (left[i][i] * left[j][j]).abs().sqrt();
            if scale > 0.0 {
                worst = worst.max((left[i][j] - right[i][j]).abs() / scale);
            }
        }
    }
    Some(worst)
}
