//! A figure as plain shapes: what PNG and PDF files hold.
//!
//! In: the SVG of a [`Plot`](super::plot::Plot). Out: lines, areas and texts in the colours of light ground. Only what the
//! figures use is read: nested `<svg>`, `<g>`, `<path>` of straight lines, `<circle>` and `<text>`.

use super::colour;
use super::font::Font;
use super::plot::{self, Place};

/// Size of text in figures, in pixels (the style sheet's).
pub(super) const FONT_SIZE: f64 = 12.0;

/// Corners of a circle.
const CORNERS: u32 = 32;

/// A colour: red, green and blue.
pub(super) type Colour = [u8; 3];

/// Lines and areas of one look.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shape {
    /// Connected points, in pixels from the upper left corner.
    pub(super) lines: Vec<Vec<Place>>,
    /// Colour of the area inside the lines.
    pub(super) fill: Option<Colour>,
    /// Colour and width of the lines.
    pub(super) stroke: Option<(Colour, f64)>,
    /// Lengths of dash and gap.
    pub(super) dash: Option<[f64; 2]>,
    /// From 0 to 1.
    pub(super) opacity: f64,
    /// Whether edges are sharp: neighbours then leave no seam.
    pub(super) is_crisp: bool,
}

/// A line of text of [`FONT_SIZE`].
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Text {
    pub(super) letters: String,
    /// Where the base line begins, in pixels from the upper left corner.
    pub(super) start: Place,
    /// Whether the text runs from below to above.
    pub(super) is_turned: bool,
    pub(super) is_bold: bool,
    pub(super) ink: Colour,
    /// Colour and width of a line around the letters, below the ink.
    pub(super) outline: Option<(Colour, f64)>,
    /// From 0 to 1.
    pub(super) opacity: f64,
}

impl Text {
    pub(super) fn font(&self) -> &'static Font {
        Font::weighing(self.is_bold)
    }
}

/// What a drawing consists of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Item {
    Shape(Shape),
    Text(Text),
}

/// A drawing, the first item at the back.
pub(super) struct Drawing {
    /// Width and height, in pixels.
    pub(super) size: Place,
    pub(super) items: Vec<Item>,
}

/// How an element looks. All values but the opacity are inherited; opacities multiply.
#[derive(Clone, Debug)]
struct Look {
    colour: Colour,
    fill: Option<Colour>,
    stroke: Option<Colour>,
    width: f64,
    dash: Option<[f64; 2]>,
    opacity: f64,
    is_bold: bool,
    is_crisp: bool,
}

const BLACK: Colour = [0; 3];

impl Look {
    const INITIAL: Self = Self {
        colour: BLACK,
        fill: Some(BLACK),
        stroke: None,
        width: 1.0,
        dash: None,
        opacity: 1.0,
        is_bold: false,
        is_crisp: false,
    };

    fn paint(&self, value: &str) -> Option<Colour> {
        if value == "currentColor" { Some(self.colour) } else { hex_colour(value) }
    }

    fn set(&mut self, parent: &Self, property: &str, value: &str) {
        let inherits = value == "inherit";
        match property {
            "color" => self.colour = hex_colour(value).unwrap_or(self.colour),
            "fill" => self.fill = self.paint(value),
            "stroke" => self.stroke = self.paint(value),
            "stroke-width" if inherits => self.width = parent.width,
            "stroke-width" => self.width = value.parse().unwrap_or(self.width),
            "stroke-dasharray" => {
                let mut lengths = value.split(' ').filter_map(|length| length.parse().ok());
                self.dash = lengths.next().zip(lengths.next()).map(|(dash, gap)| [dash, gap]);
            }
            "opacity" => self.opacity = parent.opacity * value.parse().unwrap_or(1.0),
            "font-weight" => self.is_bold = value.parse().is_ok_and(|weight: u32| weight >= 600),
            "shape-rendering" => self.is_crisp = value == "crispEdges",
            _ => {}
        }
    }
}

fn hex_colour(value: &str) -> Option<Colour> {
    let digits = value.strip_prefix('#')?;
    let channel = |from: usize, digits: &str| u8::from_str_radix(digits.get(from..from + 2)?, 16).ok();
    let long: String = match digits.len() {
        3 => digits.chars().flat_map(|digit| [digit, digit]).collect(),
        _ => digits.to_owned(),
    };
    Some([channel(0, &long)?, channel(2, &long)?, channel(4, &long)?])
}

/// A rule of the style sheet for one selector.
struct Rule<'s> {
    /// Classes with a dot, or names of elements, from the outermost to the element itself.
    parts: Vec<&'s str>,
    declarations: &'s str,
}

/// The rules of the style sheet, the weightiest last. A selector of more classes weighs more; of two alike the later.
fn rules(sheet: &str) -> Vec<Rule<'_>> {
    let blocks = sheet.split('}').filter_map(|block| block.split_once('{'));
    let mut rules = Vec::new();
    for (selectors, declarations) in blocks {
        for selector in selectors.split(',') {
            rules.push(Rule { parts: selector.trim().split(' ').collect(), declarations });
        }
    }
    rules.sort_by_key(|rule| rule.parts.iter().filter(|part| part.starts_with('.')).count());
    rules
}

/// An open element.
struct Element<'s> {
    name: &'s str,
    classes: &'s str,
    look: Look,
    origin: Place,
}

impl Element<'_> {
    fn is(&self, part: &str) -> bool {
        match part.strip_prefix('.') {
            Some(class) => self.classes.split(' ').any(|other| other == class),
            None => self.name == part,
        }
    }
}

impl Rule<'_> {
    fn matches(&self, open: &[Element<'_>], element: &Element<'_>) -> bool {
        let Some((last, outer)) = self.parts.split_last() else { return false };
        let mut ancestors = open.iter();
        element.is(last) && outer.iter().all(|part| ancestors.any(|ancestor| ancestor.is(part)))
    }
}

/// The value of an attribute.
fn attribute<'s>(tag: &'s str, name: &str) -> Option<&'s str> {
    let (_, rest) = tag.split_once(&format!(" {name}=\""))?;
    rest.split('"').next()
}

fn number(tag: &str, name: &str) -> f64 {
    attribute(tag, name).and_then(|value| value.parse().ok()).unwrap_or_default()
}

impl Drawing {
    /// The items of an SVG of this crate.
    pub(super) fn of(svg: &str) -> Self {
        let sheet = colour::plain_style();
        let rules = rules(&sheet);
        let mut items = Vec::new();
        let mut open: Vec<Element<'_>> = Vec::new();
        let mut title = false;
        for piece in svg.split('<').skip(1) {
            let Some((tag, text)) = piece.split_once('>') else { continue };
            if let Some(name) = tag.strip_prefix('/') {
                title &= name != "title";
                if open.last().is_some_and(|last| last.name == name) {
                    open.pop();
                }
                continue;
            }
            let name = tag.split([' ', '/']).next().unwrap_or_default();
            title |= name == "title";
            if title {
                continue;
            }
            let element = opened(&rules, &open, name, tag);
            match name {
                "path" => items.extend(element.shape(polylines(attribute(tag, "d").unwrap_or_default()))),
                "circle" => items.extend(element.shape(vec![circle(tag)])),
                "text" => items.extend(element.written(tag, &unescaped(text))),
                _ => {}
            }
            if !tag.ends_with('/') {
                open.push(element);
            }
        }
        Self { size: plot::size(svg), items }
    }
}

/// An element with its look, from its parent's, its attributes and the rules.
fn opened<'s>(rules: &[Rule<'_>], open: &[Element<'s>], name: &'s str, tag: &'s str) -> Element<'s> {
    let (parent, (left, top)) =
        open.last().map_or((Look::INITIAL, (0.0, 0.0)), |parent| (parent.look.clone(), parent.origin));
    let origin = if name == "svg" { (left + number(tag, "x"), top + number(tag, "y")) } else { (left, top) };
    let classes = attribute(tag, "class").unwrap_or_default();
    let mut element = Element { name, classes, look: parent.clone(), origin };
    if let Some(width) = attribute(tag, "stroke-width") {
        element.look.set(&parent, "stroke-width", width);
    }
    let matching: Vec<&Rule<'_>> = rules.iter().filter(|rule| rule.matches(open, &element)).collect();
    let declarations = || matching.iter().flat_map(|rule| rule.declarations.split(';'));
    let pairs = || declarations().filter_map(|pair| pair.split_once(':'));
    // Other properties refer to the colour.
    for is_colour in [true, false] {
        for (property, value) in pairs().map(|(property, value)| (property.trim(), value.trim())) {
            if (property == "color") == is_colour {
                element.look.set(&parent, property, value);
            }
        }
    }
    element
}

impl Element<'_> {
    fn shape(&self, mut lines: Vec<Vec<Place>>) -> Option<Item> {
        let Look { fill, stroke, width, dash, opacity, is_crisp, .. } = self.look;
        for place in lines.iter_mut().flatten() {
            *place = self.placed(*place);
        }
        let stroke = stroke.map(|colour| (colour, width));
        let shape = Shape { lines, fill, stroke, dash, opacity, is_crisp };
        (fill.is_some() || stroke.is_some()).then_some(Item::Shape(shape))
    }

    fn written(&self, tag: &str, text: &str) -> Option<Item> {
        let Look { fill, stroke, width, opacity, is_bold, .. } = self.look;
        let wide = FONT_SIZE * f64::from(Font::weighing(is_bold).width(text));
        let back = match attribute(tag, "text-anchor") {
            Some("middle") => wide / 2.0,
            Some("end") => wide,
            _ => 0.0,
        };
        let turned = attribute(tag, "transform").and_then(|transform| {
            let places = transform.strip_prefix("translate(")?.strip_suffix(") rotate(-90)")?;
            let (x, y) = places.split_once(' ')?;
            Some((x.parse::<f64>().ok()?, y.parse::<f64>().ok()?))
        });
        let start =
            turned.map_or_else(|| (number(tag, "x") - back, number(tag, "y")), |(x, y)| (x, y + back));
        Some(Item::Text(Text {
            letters: text.to_owned(),
            start: self.placed(start),
            is_turned: turned.is_some(),
            is_bold,
            ink: fill?,
            outline: stroke.map(|colour| (colour, width)),
            opacity,
        }))
    }

    fn placed(&self, (x, y): Place) -> Place {
        (x + self.origin.0, y + self.origin.1)
    }
}

/// The lines of path data as [`Path`](plot::Path) writes it: `M` to a place, `l` by a distance.
fn polylines(data: &str) -> Vec<Vec<Place>> {
    let mut lines: Vec<Vec<Place>> = Vec::new();
    let mut at = (0.0, 0.0);
    for (index, _) in data.match_indices(['M', 'l']) {
        let (command, rest) = data[index..].split_at(1);
        let end = rest.find(['M', 'l']).unwrap_or(rest.len());
        let [x, y] = pair(&rest[..end]);
        if command == "M" {
            at = (x, y);
            lines.push(vec![at]);
        } else {
            at = (at.0 + x, at.1 + y);
            lines.last_mut().into_iter().for_each(|line| line.push(at));
        }
    }
    lines
}

/// Two numbers, apart by a space or the sign of the second.
fn pair(text: &str) -> [f64; 2] {
    let cut = text.char_indices().skip(1).find(|(_, letter)| matches!(letter, ' ' | '-'));
    let (first, second) = text.split_at(cut.map_or(text.len(), |(index, _)| index));
    [first, second].map(|number| number.trim().parse().unwrap_or_default())
}

fn circle(tag: &str) -> Vec<Place> {
    let (x, y, radius) = (number(tag, "cx"), number(tag, "cy"), number(tag, "r"));
    let corner = |index: u32| {
        let turn = f64::from(index) / f64::from(CORNERS) * std::f64::consts::TAU;
        (x + radius * tropism::math::cos(turn), y + radius * tropism::math::sin(turn))
    };
    (0..=CORNERS).map(corner).collect()
}

fn unescaped(text: &str) -> String {
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn only(svg: &str) -> Shape {
        let items = Drawing::of(svg).items;
        let [Item::Shape(shape)] = items.as_slice() else { panic!("{items:?}") };
        shape.clone()
    }

    #[test]
    fn lines_have_their_places_and_the_looks_of_the_style_sheet() {
        let drawing = Drawing::of(r#"<svg class="figure" viewBox="0 0 90 60"><g/></svg>"#);
        assert_eq!((drawing.size, drawing.items.len()), ((90.0, 60.0), 0));
        let path = r#"<path class="stroke bold left" d="M10 20l-1.5-2l0.5 4M1 2l3 4"/>"#;
        let shape = only(&format!(r#"<svg class="figure" viewBox="0 0 90 60">{path}</svg>"#));
        let wanted = [vec![(10.0, 20.0), (8.5, 18.0), (9.0, 22.0)], vec![(1.0, 2.0), (4.0, 6.0)]];
        assert_eq!(shape.lines, wanted);
        assert_eq!((shape.fill, shape.stroke), (None, Some(([0x15, 0x60, 0xb8], 2.0))));
        let inner = format!(r#"<svg x="100" y="7.5" width="1" height="1" class="figure">{path}</svg>"#);
        assert_eq!(only(&format!("<svg>{inner}</svg>")).lines[1], [(101.0, 9.5), (104.0, 13.5)]);
    }

    #[test]
    fn widths_are_inherited_and_tooltips_are_not_drawn() {
        let path = r#"<path class="stroke excites" d="M0 0l1 1"><title>a text</title></path>"#;
        let group = r#"<g class="given" stroke-width="3.5">"#;
        let shape = only(&format!(r#"<svg class="figure">{group}{path}</g></svg>"#));
        assert_eq!(shape.stroke, Some(([0x17, 0x79, 0x4f], 3.5)));
        let dotted = only(r#"<svg class="figure"><path class="stroke grid dotted" d="M0 0l1 1"/></svg>"#);
        assert_eq!(dotted.dash, Some([1.0, 4.0]));
    }

    #[test]
    fn text_begins_where_its_anchor_says() {
        let text = |attributes: &str| {
            let svg = format!(
                r#"<svg><svg x="100" y="0" class="figure"><text class="label" {attributes}>a &lt; µ</text></svg></svg>"#
            );
            let items = Drawing::of(&svg).items;
            let [Item::Text(text)] = items.as_slice() else { panic!("{items:?}") };
            text.clone()
        };
        let wide = FONT_SIZE * f64::from(Font::weighing(false).width("a < µ"));
        let plain = text(r#"x="50" y="20" text-anchor="middle""#);
        assert_eq!((plain.letters.as_str(), plain.is_turned, plain.is_bold), ("a < µ", false, false));
        assert_eq!((plain.start, plain.outline), ((150.0 - wide / 2.0, 20.0), None));
        let turned = text(r#"text-anchor="end" transform="translate(13 100) rotate(-90)""#);
        assert_eq!((turned.start, turned.is_turned), ((113.0, 100.0 + wide), true));
    }
}
