//! A comparison in words.

use std::fmt;

use super::difference::{Comparison, Difference};

fn shown<T: fmt::Display>(value: Option<&T>) -> String {
    value.map_or_else(|| "(not there)".to_owned(), T::to_string)
}

fn list<T>(
    f: &mut fmt::Formatter<'_>,
    head: &str,
    rows: &[Difference<T>],
    show: impl Fn(&T) -> String,
) -> fmt::Result {
    if rows.is_empty() {
        return writeln!(f, "{head}: no difference");
    }
    writeln!(f, "{head}:")?;
    for row in rows {
        let [a, b] = [&row.a, &row.b].map(|side| side.as_ref().map(&show));
        writeln!(f, "  {:<34} {} -> {}", row.name, shown(a.as_ref()), shown(b.as_ref()))?;
    }
    Ok(())
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = &self.names;
        writeln!(f, "{a} -> {b}")?;
        list(f, "fields", &self.fields, ToString::to_string)?;
        let dots = &self.dots;
        write!(
            f,
            "dots: {} -> {}, {} in the same place or near it",
            dots.counts[0], dots.counts[1], dots.paired
        )?;
        for (place, unit, spread) in [
            ("in the image", "px", dots.image_px),
            ("on the dome", "mm", dots.surface_mm),
            ("on the plate", "mm", dots.plate_mm),
            ("in diameter", "mm", dots.diameter_mm),
        ] {
            if let Some([mean, largest]) = spread {
                write!(f, "\n  {place}: mean {mean:.4} {unit}, largest {largest:.4} {unit}")?;
            }
        }
        writeln!(f)?;
        if self.parts.is_empty() {
            writeln!(f, "parts: no difference")?;
        } else {
            writeln!(f, "parts:")?;
            for part in &self.parts {
                let [a, b] = part.volume_mm3.map(|volume| volume.map(|v| format!("{v:.2} mm3")));
                write!(f, "  {:<34} {} -> {}", part.name, shown(a.as_ref()), shown(b.as_ref()))?;
                if part.size_mm[0] != part.size_mm[1] {
                    let [a, b] =
                        part.size_mm.map(|size| size.map(|s| s.map(|v| format!("{v:.3}")).join(" x ")));
                    write!(f, ", {} -> {} mm", shown(a.as_ref()), shown(b.as_ref()))?;
                }
                if let [Some(a), Some(b)] = part.volume_mm3 {
                    write!(f, " ({:+.4})", b - a)?;
                }
                writeln!(f)?;
            }
        }
        list(f, "loads (N, N*mm)", &self.loads, Clone::clone)?;
        list(f, "standard deviation of the wrench at rest (N, N*mm)", &self.wrench_sd, |sd| {
            format!("{sd:.5}")
        })?;
        match self.stiffness_share {
            Some(0.0) => writeln!(f, "stiffness: no difference"),
            Some(share) => writeln!(f, "stiffness: up to {:.3} % of its diagonal", 100.0 * share),
            None => writeln!(f, "stiffness: not on both sides"),
        }
    }
}
