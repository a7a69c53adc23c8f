//! Sweeps as files.

use std::path::Path;

use tropism_lab::Error;
use tropism_lab::sweep::{Method, Setting, SweepConfig};

fn config(text: &str) -> SweepConfig {
    toml::from_str(text).unwrap()
}

fn settings(text: &str) -> Result<Vec<Setting>, Error> {
    config(text).settings(Path::new(""))
}

#[test]
fn a_grid_makes_all_combinations() {
    let found = settings(
        "seeds = 2\n[grid]\nevolution.neat.population = [25, 50]\n\"evolution.episodes\" = [1, 2, 4]\n\
         [evolve]\nevolution.generations = 7\n",
    )
    .unwrap();
    let names: Vec<&str> = found.iter().map(|setting| setting.name.as_str()).collect();
    let wanted = [(1, 25), (1, 50), (2, 25), (2, 50), (4, 25), (4, 50)];
    assert_eq!(names, wanted.map(|(episodes, size)| format!("episodes={episodes}, population={size}")));
    let Method::Evolve(config) = &found[3].method else { panic!("no evolution") };
    let evolution = &config.evolution;
    assert_eq!((evolution.generations, evolution.episodes, evolution.neat.population), (7, 2, 50));
    assert_eq!(settings("seeds = [3, 9]").unwrap()[0].name, "as given");
}

#[test]
fn settings_keep_their_order_when_the_file_is_written_again() {
    let first = config(
        "[grid]\nevolution.neat.population = [25, 50]\nevolution.episodes = [4, 1]\ntrial_plants = [9]\n",
    );
    let again = config(&toml::to_string(&first).unwrap());
    assert_eq!(first.settings(Path::new("")).unwrap(), again.settings(Path::new("")).unwrap());
}

#[test]
fn the_example_is_a_sweep() {
    let example = config(include_str!("../../../../studies/sweep.toml"));
    let found = example.settings(Path::new("studies")).unwrap();
    assert_eq!((found.len(), example.seeds.list()), (4, vec![1, 2, 3, 4, 5]));
    // The paper's own setting is one of them.
    assert_eq!(found[0].name, "crossover_rate=0.5, population=50");
}

#[test]
fn tables_of_a_list_go_by_their_names() {
    let text = "[grid]\nmethods.rule.search.population = [8, 16]\nplants = [2]\n[replicates]\nreplicates = 1\n\
                methods = [{ name = \"rule\", kind = \"tune\", model = \"stem\" }]\n\
                scenarios = [{ name = \"sunflower\", bean = \"../beans/sunflower.toml\" }]\n";
    let found = config(text).settings(Path::new("studies")).unwrap();
    assert_eq!(found[1].name, "population=16, plants=2");
    let Method::Replicates(config) = &found[1].method else { panic!("no replicates") };
    assert_eq!(config.scenarios[0].bean.as_deref(), Some(Path::new("studies/../beans/sunflower.toml")));
}

#[test]
fn what_is_wrong_is_named() {
    for (text, wanted) in [
        (
            "[grid]\nevolution.neat.populatoin = [5]",
            "grid: evolution.neat.populatoin = 5: unknown field `populatoin`",
        ),
        ("[grid]\nevolution.neat.population = [50, 0]", "grid: evolution.neat.population = 0: evolution: "),
        ("[grid]\nevolution.runs = 3", "found evolution.runs = 3, wanted a list of values"),
        ("[grid]\n\"evolution.runs\" = [3, 3]", "found 3 twice"),
        ("[grid]\nseed = [1, 2]", "write `seeds`"),
        ("[evolve]\nseed = 1", "write `seeds`"),
        (
            "[grid]\ntrial_plants.x = [1]\n[evolve]\ntrial_plants = 3",
            "found trial_plants = 3, wanted a table",
        ),
        ("seeds = [1, 1]", "seed 1 stands twice"),
        ("seeds = 0", "found 0 seeds, wanted 1 to"),
        ("[evolve]\n[replicates]", "keep one"),
        ("model = \"m.json\"\n[replicates]", "which make models of their own"),
        ("[grid]\nmethods.x.kind = [1]\n[replicates]\nmethods = []", "there is no table x in methods"),
    ] {
        let error = settings(text).unwrap_err().to_string();
        assert!(error.contains(wanted), "{text}: {error}");
    }
}
