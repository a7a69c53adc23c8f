//! How long the native program takes for what the page does: `cargo run --profile web -p tropism-wasm --example speed`. The same
//! questions are timed in Node by `tests/web/measure.js`.

use std::time::Instant;

use tropism_wasm::{Question, Session};

/// Asks, prints how long it took, and gives the answer.
fn time(session: &mut Session, what: &str, question: &str) -> serde_json::Value {
    let question: Question = serde_json::from_str(question).expect("a question of this program");
    let began = Instant::now();
    let answer = session.answer(question, &[]).expect("a question that has an answer");
    println!("{what}: {:.0} ms", began.elapsed().as_secs_f64() * 1e3);
    answer.json
}

fn main() {
    let mut session = Session::default();
    time(&mut session, "six beans of 1000 steps and their model", r#"{"fit":{}}"#);
    let begin = r#"{"begin":{"task":{"kind":"targets","targets":[[3,6],[-5,9],[-1,13.5]],"end_height_cm":13.8},
        "evolution":{"runs":2,"generations":300},"seed":1,"own":[0,1]}}"#;
    time(&mut session, "beginning", begin);
    time(&mut session, "two runs of 300 generations", r#"{"advance":{"generations":300}}"#);
    let champions = time(&mut session, "their champions", r#"{"finish":{}}"#);
    println!("best fitness {} and {} cm", champions[0]["best"], champions[1]["best"]);
}
