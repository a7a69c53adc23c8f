//! Tables of points that were marked by hand on real photographs, in pixels.

use std::path::Path;

use tropism::geometry::Pixel;

/// A row of a table.
pub(crate) struct Row {
    header: csv::StringRecord,
    /// Values in the order of the columns.
    pub(crate) record: csv::StringRecord,
}

impl Row {
    pub(crate) fn text(&self, column: &str) -> &str {
        let at = self.header.iter().position(|name| name == column);
        &self.record[at.unwrap_or_else(|| panic!("no column {column}"))]
    }

    pub(crate) fn number(&self, column: &str) -> f64 {
        self.text(column).parse().unwrap_or_else(|_| panic!("{column}: {:?}", self.text(column)))
    }

    /// The pixel in the columns whose names begin with `name`.
    pub(crate) fn place(&self, name: &str) -> Pixel {
        Pixel::new(self.number(&format!("{name}x_px")), self.number(&format!("{name}y_px")))
    }

    /// Distance of a tip from the marked one; any point of a flat top counts as the tip.
    pub(crate) fn miss(&self, tip: Pixel) -> f64 {
        let x = tip.x.clamp(self.number("top_flat_x_min_px"), self.number("top_flat_x_max_px"));
        tip.distance(Pixel::new(x, self.number("top_y_px")))
    }
}

/// Reads the table at `path`.
pub(crate) fn rows(path: &Path) -> Vec<Row> {
    let mut table =
        csv::Reader::from_path(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let header = table.headers().expect("a header").clone();
    table.records().map(|record| Row { header: header.clone(), record: record.expect("a row") }).collect()
}
