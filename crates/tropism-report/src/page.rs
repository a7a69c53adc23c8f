//! The report page: one HTML file that needs no other file.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use serde::{Deserialize, Serialize};

use sha2::{Digest, Sha256};

use super::{Body, Figure, Plants, colour, names, orthographic, plot};

/// A number of the paper beside the one found here.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NumberRow {
    /// The quantity, with its unit.
    pub what: String,
    /// As printed in the paper; empty if it gives none.
    pub paper: String,
    /// As found here.
    pub ours: String,
    /// Whether the paper's number was reproduced: `yes`, `partly` or `no`; empty if it gives none.
    pub reproduced: String,
    /// A note for the reader; may be empty.
    pub note: String,
}

/// A figure that a report does not have, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LeftOut {
    /// Its number.
    pub figure: String,
    /// Why it is left out, and what it needs.
    pub reason: String,
}

/// A further table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Title.
    pub title: String,
    /// Caption; may be empty.
    pub caption: String,
    /// Column headers.
    pub head: Vec<String>,
    /// Rows, with one text a column. The first column is aligned left, all others right.
    pub rows: Vec<Vec<String>>,
}

/// The content of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Title.
    pub title: String,
    /// Introduction; an empty line begins a new paragraph.
    pub intro: String,
    /// The kind of plants: a page on virtual plants has a banner.
    pub plants: Plants,
    /// Numbers of the paper beside those found here.
    pub numbers: Vec<NumberRow>,
    /// Further tables.
    pub tables: Vec<Table>,
    /// Figures in order; figures of one number (`5a`, `5b`) are grouped.
    pub figures: Vec<Figure>,
    /// Figures that are left out.
    pub left_out: Vec<LeftOut>,
    /// The command that reproduces this report; may be empty.
    pub command: String,
    /// Version of the software.
    pub version: String,
    /// Seeds, each with the name of what it seeds.
    pub seeds: Vec<(String, u64)>,
    /// Stages in order, each with its duration in seconds.
    pub stages: Vec<(String, f64)>,
    /// The resolved configuration, as TOML.
    pub config: String,
}

impl Page {
    /// The page as HTML, with its style sheet, figures and pictures, without links to other files. Where it shows a plant in space it
    /// has one script, by which the reader turns it; a policy in the page keeps all others and the network out.
    #[must_use]
    pub fn html(&self) -> String {
        self.html_with(None)
    }

    /// The same of work that is not finished: a browser reads the page again after `refresh_s` seconds.
    #[must_use]
    pub fn growing_html(&self, refresh_s: u32) -> String {
        self.html_with(Some(refresh_s))
    }

    fn html_with(&self, refresh_s: Option<u32>) -> String {
        let style = format!("{}{}", colour::style(), include_str!("page.css"));
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    @if let Some(seconds) = refresh_s { meta http-equiv="refresh" content=(seconds); }
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta name="generator" content={ "tropism " (self.version) };
                    meta http-equiv="Content-Security-Policy" content=(self.policy());
                    title { (self.title) }
                    style { (PreEscaped(style)) }
                }
                body {
                    (self.contents())
                    main {
                        (self.header())
                        (self.beside_the_paper())
                        @for (index, table) in self.tables.iter().enumerate() { (further_table(index, table)) }
                        (self.all_figures())
                        (self.provenance())
                    }
                    @if self.has_space() { script { (PreEscaped(orthographic::SCRIPT)) } }
                }
            }
        }
        .into_string()
    }

    /// Whether a figure shows a plant in space.
    fn has_space(&self) -> bool {
        self.figures.iter().any(|figure| matches!(figure.body, Body::Space { .. }))
    }

    /// The content security policy: pictures and styles of the page itself, and of scripts the one that turns plants.
    fn policy(&self) -> String {
        let policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";
        if self.has_space() {
            let hash = BASE64.encode(Sha256::digest(orthographic::SCRIPT));
            format!("{policy}; script-src 'sha256-{hash}'")
        } else {
            policy.to_owned()
        }
    }

    fn contents(&self) -> Markup {
        html! {
            nav aria-label="Contents" {
                p.contents { "Contents" }
                ol {
                    @if !self.numbers.is_empty() { li { a href="#numbers" { "Beside the paper" } } }
                    @for (index, table) in self.tables.iter().enumerate() {
                        li { a href={ "#table-" (index + 1) } { (table.title) } }
                    }
                    @for (figure, name) in self.figures.iter().zip(names(&self.figures)) {
                        li.figure-link {
                            a href={ "#figure-" (name) } {
                                @if is_numbered(figure) { b { (figure.number) } " " }
                                (figure.title)
                            }
                        }
                    }
                    li { a href="#provenance" { "How this was made" } }
                }
            }
        }
    }

    fn header(&self) -> Markup {
        html! {
            header {
                h1 { (self.title) }
                @if self.plants.is_virtual() {
                    p.banner role="note" {
                        strong { "Virtual plants" }
                        " The plants in this report are simulated. None of them grew, and no number here was measured on a \
                         living plant."
                    }
                }
                @for paragraph in self.intro.split("\n\n").filter(|paragraph| !paragraph.trim().is_empty()) {
                    p.intro { (paragraph.trim()) }
                }
            }
        }
    }

    fn beside_the_paper(&self) -> Markup {
        if self.numbers.is_empty() {
            return html! {};
        }
        html! {
            section #numbers {
                h2 { "Beside the paper" }
                div.scroll {
                    table.numbers {
                        thead { tr { td {} th scope="col" { "Paper" } th scope="col" { "Here" } th scope="col" { "Reproduced" } } }
                        tbody {
                            @for row in &self.numbers {
                                tr {
                                    th scope="row" {
                                        (row.what)
                                        @if !row.note.is_empty() { span.note { (row.note) } }
                                    }
                                    td.number data-label="Paper" { (or_dash(&row.paper)) }
                                    td.number.ours data-label="Here" { (or_dash(&row.ours)) }
                                    td.number data-label="Reproduced" { (or_dash(&row.reproduced)) }
                                }
                            }
                        }
                    }
                }
                p.source {
                    "Paper: Wahby, Hofstadler, Heinrich, Zahadat and Hamann, "
                    i { "An Evolutionary Robotics Approach to the Control of Plant Growth and Motion" }
                    ", SASO 2016, doi:10.1109/SASO.2016.8."
                }
            }
        }
    }

    fn all_figures(&self) -> Markup {
        if self.figures.is_empty() {
            return html! {};
        }
        let names = names(&self.figures);
        let named: Vec<(&Figure, &String)> = self.figures.iter().zip(&names).collect();
        html! {
            section #figures {
                h2 { "Figures" }
                @if self.figures.iter().any(is_numbered) { p.source { "Numbered as in the paper." } }
                @for family in named.chunk_by(|(a, _), (b, _)| family(a) == family(b)) {
                    div class=(if family.len() == 1 { "family single" } else { "family" }) {
                        @for (figure, name) in family { (drawn(figure, name)) }
                    }
                }
                @if !self.left_out.is_empty() {
                    p.source { "Left out:" }
                    ul.source {
                        @for LeftOut { figure, reason } in &self.left_out { li { b { "Figure " (figure) } ": " (reason) } }
                    }
                }
            }
        }
    }

    fn provenance(&self) -> Markup {
        html! {
            section #provenance {
                h2 { "How this was made" }
                dl {
                    dt { "Software" } dd { "tropism " (self.version) }
                    @if !self.command.is_empty() { dt { "Command" } dd { code { (self.command) } } }
                    @for (what, seed) in &self.seeds { dt { "Seed, " (what) } dd { code { (seed) } } }
                }
                @if !self.stages.is_empty() { (time_spent(&self.stages)) }
                @if !self.config.is_empty() {
                    h3 { "Configuration" }
                    pre { code { (self.config) } }
                }
            }
        }
    }
}

fn or_dash(text: &str) -> &str {
    if text.is_empty() { "\u{2013}" } else { text }
}

/// Whether a figure has a number of the paper.
fn is_numbered(figure: &Figure) -> bool {
    figure.number.starts_with(|letter: char| letter.is_ascii_digit())
}

/// The number of a figure without its letter.
fn family(figure: &Figure) -> &str {
    let is_letter = |letter: char| is_numbered(figure) && letter.is_ascii_alphabetic();
    figure.number.trim_end_matches(is_letter)
}

/// Whether a figure needs the full width of the page.
fn is_wide(figure: &Figure) -> bool {
    match &figure.body {
        Body::Svg(svg) => plot::size(svg).0 > 600.0,
        Body::Jpegs(_) | Body::Space { .. } => true,
    }
}

/// A figure with its caption; `name` distinguishes it from others of its number.
fn drawn(figure: &Figure, name: &str) -> Markup {
    let (number, title) = (figure.number, &figure.title);
    html! {
        figure #{ "figure-" (name) } class=(if is_wide(figure) { "wide" } else { "" }) {
            @match &figure.body {
                Body::Svg(svg) => (drawing(svg, title)),
                Body::Space { svg, scene } => {
                    (drawing(svg, title))
                    (turnable(scene, title))
                },
                Body::Jpegs(jpegs) if jpegs.is_empty() => p.none { "No photographs." },
                Body::Jpegs(jpegs) => div.strip style={ "--columns:" (jpegs.len().min(6)) } {
                    @for (index, jpeg) in jpegs.iter().enumerate() {
                        span {
                            img alt={ (title) ", " (index + 1) }
                                src={ "data:image/jpeg;base64," (BASE64.encode(jpeg)) };
                            b { (index + 1) }
                        }
                    }
                },
            }
            figcaption { p.title { @if is_numbered(figure) { b { "Figure " (number) } " " } (title) } p { (figure.caption) } }
        }
    }
}

fn drawing(svg: &str, title: &str) -> Markup {
    html! { div.drawing role="img" aria-label=(title) { (PreEscaped(svg)) } }
}

/// A scene that the reader turns. It is hidden until the script of the page has found it.
fn turnable(scene: &str, title: &str) -> Markup {
    // A name with `</script>` would end the element: `<` is escaped.
    let scene = scene.replace('<', "\\u003c");
    html! {
        div.turnable hidden {
            script type="application/json" { (PreEscaped(scene)) }
            svg.figure tabindex="0" role="application" aria-label=(title) data-title=(title) {}
            p.controls {
                @for (view, text) in [("front", "Front"), ("side", "Side"), ("above", "Above")] {
                    button type="button" data-view=(view) { (text) }
                }
                button type="button" data-view="nearer" aria-label="Zoom in" { "+" }
                button type="button" data-view="farther" aria-label="Zoom out" { "\u{2212}" }
                button type="button" data-view="reset" { "Reset" }
                output {}
            }
            p.source {
                "Turn it with the mouse, a finger or the arrow keys; zoom with + and \u{2212} or, once it is chosen, the wheel; 0 \
                 resets. The grid is the height of the root; the names are the directions of the lamps. Nearer lines are \
                 wider and stronger."
            }
        }
    }
}

fn further_table(index: usize, table: &Table) -> Markup {
    html! {
        section #{ "table-" (index + 1) } {
            h2 { (table.title) }
            div.scroll {
                table.further {
                    thead { tr { @for head in &table.head { th scope="col" { (head) } } } }
                    tbody {
                        @for row in &table.rows {
                            tr { @for (head, value) in table.head.iter().zip(row) { td data-label=(head) { (value) } } }
                        }
                    }
                }
            }
            @if !table.caption.is_empty() { p.source { (table.caption) } }
        }
    }
}

fn time_spent(stages: &[(String, f64)]) -> Markup {
    let total: f64 = stages.iter().map(|(_, seconds)| seconds).sum();
    let share = |seconds: f64| if total > 0.0 { 100.0 * seconds / total } else { 0.0 };
    html! {
        h3 { "Time spent" }
        table.stages {
            tbody {
                @for (stage, seconds) in stages {
                    tr {
                        th scope="row" { (stage) }
                        td.number { (duration(*seconds)) }
                        td.bar { span style={ "width:" (format!("{:.1}", share(*seconds))) "%" } {} }
                    }
                }
                tr.total { th scope="row" { "All" } td.number { (duration(total)) } td {} }
            }
        }
    }
}

/// A duration for people: `0.4 s`, `12 s`, `3 min 05 s`, `2 h 10 min`.
fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..120 => format!("{whole} s"),
        120..7200 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate as report;
    use crate::{Composite, testing};
    use tropism::geometry::Point;
    use tropism::photo::Image;

    fn page(plants: Plants) -> Page {
        let tracks = testing::swings(6, 1000);
        let fitness: Vec<f64> = (0..100).map(|generation| f64::from(generation) / 8.0).collect();
        let photograph = Image { width: 60, height: 40, rgb: vec![30; 3 * 60 * 40] };
        let experiment: Composite = [photograph].into_iter().collect();
        let mut figures = vec![
            report::composite(&[experiment.clone(), experiment], plants),
            report::speed(&tracks, plants),
            report::trajectories(&tracks, plants),
            report::directions(&tracks, plants),
        ];
        figures.extend(report::shift_maps(&tracks, plants));
        figures.push(report::fitness_boxes(&[fitness.clone(), fitness.clone()], "cm", plants));
        figures.push(report::fitness_run(0, "one of all", [&fitness, &fitness], "cm", plants));
        let goals = report::Goals {
            targets: vec![Point::new(3.0, 6.0), Point::new(-5.0, 9.0)],
            ..report::Goals::default()
        };
        for (number, track) in ["7a", "7b", "8"].into_iter().zip(&tracks) {
            figures.push(report::steering(
                number,
                "A <controller>",
                track,
                &goals,
                (14.3, Some(15.0)),
                plants,
            ));
        }
        Page {
            title: "Six beans & one lamp".to_owned(),
            intro: "First.\n\nSecond <b>.".to_owned(),
            plants,
            numbers: vec![NumberRow {
                what: "best evolved (cm)".to_owned(),
                paper: "14.97".to_owned(),
                ours: "14.1".to_owned(),
                reproduced: "partly".to_owned(),
                note: String::new(),
            }],
            tables: vec![Table {
                title: "Six plants".to_owned(),
                head: vec!["plant".to_owned(), "fitness".to_owned()],
                rows: vec![vec!["1".to_owned(), "9.4".to_owned()]],
                ..Table::default()
            }],
            figures,
            left_out: vec![LeftOut { figure: "9".to_owned(), reason: "no <stem> is detected".to_owned() }],
            command: "tropism study --seed 1".to_owned(),
            version: "0.1.0".to_owned(),
            seeds: vec![("study".to_owned(), 1)],
            stages: vec![("photographs".to_owned(), 61.0), ("evolution".to_owned(), 9.04)],
            config: "[task]\ntargets = [[3, 6]]\n".to_owned(),
        }
    }

    #[test]
    fn the_page_has_all_figures_and_needs_no_other_file() {
        let html = page(Plants::Virtual).html();
        testing::assert_well_formed(&html);
        for number in ["2", "3", "4a", "4b", "5a", "5b", "5c", "5d", "6a", "6b", "7a", "7b", "8"] {
            assert!(html.contains(&format!("id=\"figure-{number}\"")), "no figure {number}");
            assert!(html.contains(&format!("href=\"#figure-{number}\"")), "no link to figure {number}");
        }
        for foreign in ["http:", "https:", "//", "@import", "<script", "url("] {
            let text: String =
                html.split("base64,").map(|piece| piece.split_once('"').map_or(piece, |p| p.1)).collect();
            assert!(!text.contains(foreign), "{foreign}");
        }
        assert!(html.contains("<b>Figure 9</b>: no &lt;stem&gt; is detected"));
        let cells = html.matches("<td").count() - html.matches("<td></td>").count();
        let of_stages = 2 * 3;
        assert_eq!(html.matches("data-label=").count() + of_stages - 1, cells, "each cell names its column");
        assert!(html.contains("doi:10.1109/SASO.2016.8"));
        assert!(html.contains("targets = [[3, 6]]") && html.contains("tropism study --seed 1"));
        assert!(html.len() < 1_000_000, "{} bytes", html.len());
        assert_eq!(html, page(Plants::Virtual).html());
    }

    #[test]
    fn a_plant_in_space_is_turned_by_the_page_itself() {
        let around = report::Surroundings::of(&tropism::task::Task::spiral());
        let in_space =
            report::in_space("8", "A plant", &testing::winding(40), &around, Plants::Virtual).unwrap();
        let Body::Space { svg, scene } = in_space.body.clone() else { panic!() };
        let page = Page { figures: vec![in_space.clone(), in_space], ..page(Plants::Virtual) };
        let html = page.html();
        testing::assert_well_formed(&html);
        assert!(!html.contains("http:") && !html.contains("https:"));
        // Each figure has its drawing for readers without scripts, and its scene; the page has one script.
        assert_eq!(html.matches(&svg).count(), 2);
        assert_eq!(html.matches(&scene).count(), 2);
        for name in ["8", "8-b"] {
            assert_eq!(html.matches(&format!("id=\"figure-{name}\"")).count(), 1);
            assert_eq!(html.matches(&format!("href=\"#figure-{name}\"")).count(), 1);
        }
        assert_eq!(html.matches(orthographic::SCRIPT).count(), 1);
        assert_eq!(html.matches("<script>").count(), 1);
        let hash = BASE64.encode(Sha256::digest(orthographic::SCRIPT));
        assert!(html.contains(&format!(
            "default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src 'sha256-{hash}'"
        )));
    }

    #[test]
    fn a_scene_cannot_end_its_element() {
        let html = turnable(r#"{"name":"</script><b>"}"#, "A <b>").into_string();
        assert_eq!(html.matches("</script>").count(), 1);
        assert!(html.contains(r#"{"name":"\u003c/script>\u003cb>"}"#) && !html.contains("<b>"));
    }

    #[test]
    fn text_from_outside_is_escaped() {
        let html = page(Plants::Virtual).html();
        assert!(html.contains("Six beans &amp; one lamp") && html.contains("Second &lt;b&gt;."));
        assert!(html.contains("A &lt;controller&gt;") && !html.contains("<controller>"));
    }

    #[test]
    fn only_virtual_plants_have_the_banner() {
        let banner = "class=\"banner\"";
        assert!(page(Plants::Virtual).html().contains(banner));
        assert!(page(Plants::ModelOfVirtual).html().contains(banner));
        assert!(!page(Plants::Real).html().contains(banner));
    }

    #[test]
    fn an_empty_page_is_still_a_page() {
        let empty = Page {
            numbers: Vec::new(),
            tables: Vec::new(),
            figures: Vec::new(),
            stages: vec![("nothing".to_owned(), 0.0)],
            ..page(Plants::Real)
        };
        testing::assert_well_formed(&empty.html());
    }

    #[test]
    fn every_link_has_its_target() {
        let html = page(Plants::Virtual).html();
        for link in html.split("href=\"#").skip(1) {
            let id = link.split('"').next().unwrap_or_default();
            assert!(html.contains(&format!("id=\"{id}\"")), "{id}");
        }
    }

    #[test]
    fn durations_have_fitting_units() {
        let spoken = [0.44, 12.4, 119.6, 185.0, 7800.0].map(duration);
        assert_eq!(spoken, ["0.4 s", "12 s", "2 min 00 s", "3 min 05 s", "2 h 10 min"]);
    }
}
