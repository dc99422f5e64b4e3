//! The measured print as a table: `id,x_mm,y_mm` (view from outside) or `id,phi_deg,theta_deg`, optionally
//! with `print`.
//!
//! # Example
//! ```
//! use domecast_design::transfer::measured_csv::read;
//!
//! let table = read("id,x_mm,y_mm\n0,0.02,-0.01\n1,3.05,0.01\n", 10.0)?;
//! assert_eq!((table.rows.len(), table.rows[1].id), (2, 1));
//! # Ok::<(), domecast_design::transfer::measured_csv::PrintTableError>(())
//! ```

use std::collections::BTreeMap;
use std::fmt;

use glam::{DVec2, DVec3};

use super::fit::MeasuredIn;
use domecast_optics::numeric::csv::{CsvRow, repeated, rows as rows_of};

/// A measured table.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredTable {
    /// Which of the two kinds it is.
    pub measured_in: MeasuredIn,
    /// Its rows.
    pub rows: Vec<MeasuredRow>,
    /// Names of the prints; a row's `print` is an index into it. One without name if there is no such column.
    pub prints: Vec<String>,
}

/// A row of a measured table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredRow {
    /// Line in the file, from 1.
    pub line: usize,
    /// The mark.
    pub id: u32,
    /// Index of the print.
    pub print: usize,
    /// Where the mark was found: unit direction from the dome's centre, sensor frame.
    pub landed: DVec3,
}

/// A fault of a measured table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PrintTableError {
    /// Line in the file, from 1.
    pub line: usize,
    /// Column, by its name; empty for the whole line.
    pub column: String,
    /// What stands there.
    pub value: String,
    /// What is wrong.
    pub problem: String,
    /// What is allowed.
    pub allowed: String,
}

impl fmt::Display for PrintTableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}", self.line)?;
        if !self.column.is_empty() {
            write!(f, ", column {}", self.column)?;
        }
        if !self.value.is_empty() {
            write!(f, ": {:?}", self.value)?;
        }
        write!(f, ": {}; allowed: {}", self.problem, self.allowed)
    }
}

impl std::error::Error for PrintTableError {}

const KINDS: &str = "id,x_mm,y_mm or id,phi_deg,theta_deg, and print if there are several";

/// Reads a measured table. Empty lines and lines that start with `#` are passed over; a byte-order mark and
/// either kind of line end are accepted, and so are further columns.
///
/// # Errors
/// The first fault, with its line.
pub fn read(text: &str, dome_radius_mm: f64) -> Result<MeasuredTable, PrintTableError> {
    let mut lines = rows_of(text);
    let head = lines
        .next()
        .ok_or_else(|| fault(1, "", "", "the table is empty", "a line with the columns' names first"))?;
    let names: Vec<String> = head.cells.iter().map(|name| name.to_ascii_lowercase()).collect();
    let column = |name: &str| names.iter().position(|n| n == name);
    if let Some(name) = repeated(&names) {
        return Err(fault(head.line, name, name, "the column is there twice", "each column once"));
    }
    let missing = |name: &str| fault(head.line, name, head.text, "the column is missing", KINDS);
    let id_at = column("id").ok_or_else(|| missing("id"))?;
    let (measured_in, names_of_place) =
        match (column("x_mm"), column("y_mm"), column("phi_deg"), column("theta_deg")) {
            (Some(x), Some(y), _, _) => (MeasuredIn::View, [(x, "x_mm"), (y, "y_mm")]),
            (_, _, Some(phi), Some(theta)) => (MeasuredIn::Dome, [(phi, "phi_deg"), (theta, "theta_deg")]),
            (Some(_), None, ..) => return Err(missing("y_mm")),
            (None, Some(_), ..) => return Err(missing("x_mm")),
            (_, _, Some(_), None) => return Err(missing("theta_deg")),
            (_, _, None, Some(_)) => return Err(missing("phi_deg")),
            _ => return Err(missing("x_mm")),
        };
    let print_at = column("print");

    let mut prints: Vec<String> = Vec::new();
    let mut seen: BTreeMap<(u32, usize), usize> = BTreeMap::new();
    let mut rows = Vec::new();
    for CsvRow { line, text: content, cells: values } in lines {
        if values.len() != names.len() {
            let problem = format!("{} cells, the head has {}", values.len(), names.len());
            return Err(fault(line, "", content, &problem, "as many cells as the head"));
        }
        let id: u32 = values[id_at]
            .parse()
            .map_err(|_| fault(line, "id", values[id_at], "not a mark's number", "a whole number from 0"))?;
        let mut place = [0.0; 2];
        for (value, (at, name)) in place.iter_mut().zip(names_of_place) {
            *value = values[at]
                .parse()
                .ok()
                .filter(|number: &f64| number.is_finite())
                .ok_or_else(|| fault(line, name, values[at], "not a number", "a finite number"))?;
        }
        let name = print_at.map_or("", |at| values[at]);
        let print = prints.iter().position(|known| known == name).unwrap_or_else(|| {
            prints.push(name.to_owned());
            prints.len() - 1
        });
        if let Some(first) = seen.insert((id, print), line) {
            let problem = format!("mark {id} stands already on line {first}");
            return Err(fault(line, "id", values[id_at], &problem, "each mark once in each print"));
        }
        let landed = direction(measured_in, place, dome_radius_mm)
            .map_err(|(column, problem, allowed)| fault(line, column, content, &problem, &allowed))?;
        rows.push(MeasuredRow { line, id, print, landed });
    }
    Ok(MeasuredTable { measured_in, rows, prints })
}

fn fault(line: usize, column: &str, value: &str, problem: &str, allowed: &str) -> PrintTableError {
    PrintTableError {
        line,
        column: column.into(),
        value: value.chars().take(60).collect(),
        problem: problem.into(),
        allowed: allowed.into(),
    }
}

/// The unit direction of a mark's place: x and y (mm) in the view from outside, or polar angle and azimuth (degrees).
/// The error is the column at fault, the problem and what is allowed.
fn direction(
    measured_in: MeasuredIn,
    place: [f64; 2],
    dome_radius_mm: f64,
) -> Result<DVec3, (&'static str, String, String)> {
    match measured_in {
        MeasuredIn::View => {
            let flat = DVec2::from_array(place) / dome_radius_mm;
            let inside = 1.0 - flat.length_squared();
            if inside < 0.0 {
                let off_mm = flat.length() * dome_radius_mm;
                let problem = format!("the point lies {off_mm:.4} mm from the pole's axis, beyond the dome");
                return Err(("x_mm, y_mm", problem, format!("up to the dome's radius, {dome_radius_mm} mm")));
            }
            Ok(flat.extend(inside.sqrt()))
        }
        MeasuredIn::Dome => {
            let [phi_deg, theta_deg] = place;
            if !(0.0..=90.0).contains(&phi_deg) {
                return Err(("phi_deg", "the point lies beyond the dome".into(), "0 to 90".into()));
            }
            let (sin, cos) = phi_deg.to_radians().sin_cos();
            Ok((DVec2::from_angle(theta_deg.to_radians()) * sin).extend(cos))
        }
    }
}
