//! Files of tuned rules.

use super::leaning;
use tropism::control::PredictiveRule;
use tropism::evolve::{Trial, TunedRule};
use tropism::task::Task;

fn rule() -> TunedRule {
    let numbers = PredictiveRule { overshoot: 0.45, shift_steps: 6.1, ..PredictiveRule::default() };
    let expected = Some(Trial { mean: 9.1, sd: 2.5, plants: 1000 });
    TunedRule {
        task: Some(Task::default()),
        ..TunedRule::of_model(numbers, &leaning(), "{}", true, expected)
    }
}

#[test]
fn a_rule_file_comes_back() {
    let rule = rule();
    assert!(TunedRule::is_named_in(&rule.to_json()));
    assert_eq!(TunedRule::from_json(&rule.to_json()).unwrap(), rule);
    let outside = TunedRule { task: None, ..rule };
    assert_eq!(TunedRule::from_json(&outside.to_json()).unwrap(), outside);
}

#[test]
fn bad_rules_are_refused() {
    let text = rule().to_json();
    let error = |text: &str| TunedRule::from_json(text).unwrap_err().to_string();
    assert!(error("{").contains("found no rule"));
    assert!(error(&text.replace("rule/1", "rule/9")).contains("wanted \"tropism.rule/1\""));
    assert!(error(&text.replace("\"overshoot\"", "\"overshot\"")).contains("unknown field `overshot`"));
    assert!(error(&text.replace("\"overshoot\"", "\"overshot\"")).contains("at line 3"));
    assert!(
        error(&text.replace("\"look_ahead_cm\": 1.0", "\"look_ahead_cm\": 0.0"))
            .contains("rule.look_ahead_cm")
    );
    assert!(error(&text.replace("\"period_min\": 5.0", "\"period_min\": -5.0")).contains("period_min"));
    assert!(error(&text.replace("\"max_steps\": 1000", "\"max_steps\": 0")).contains("task.max_steps"));
}
