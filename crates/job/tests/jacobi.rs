//! Chains or walks: what a job with `walk = "jacobi"` or `"auto"` becomes.

use std::path::Path;

use job::{Error, Job, Sampler, WalkKind, job_hash, load};
use radiosity::methods::{BatchScore, Batches, Iterations, Solve};

/// A job on the 54-patch cube.
fn cube54(set: &[&str]) -> Job {
    load_cube54(set).unwrap()
}

fn load_cube54(set: &[&str]) -> Result<Job, Error> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/cube54.toml");
    load(&path, &set.iter().map(|&set| set.to_owned()).collect::<Vec<_>>())
}

#[test]
fn eight_chains_share_the_rays_unless_the_job_says_otherwise() {
    let job = cube54(&["method.walk=jacobi", "budget.paths=100003"]);
    assert_eq!((job.method.walk, job.method.sampler), (WalkKind::Jacobi, Sampler::Sobol));
    assert_eq!((job.method.batch_paths, job.note), (Some(12_500), None));
    let job = cube54(&["method.walk=jacobi", "budget.paths=100003", "method.batch_paths=2000"]);
    assert_eq!(job.method.batch_paths, Some(2000));
}

#[test]
fn chains_of_many_patches_are_kept_short() {
    let budget = "budget.paths=100000000000";
    assert_eq!(cube54(&["method.walk=jacobi", budget]).method.batch_paths, Some(u32::MAX.into()));
    let folder = crate::common::Folder::new("many-patches");
    let scene = "[material.w]\nreflectance = 0.5\nemittance = 1\n[[surface]]\nmaterial = \"w\"\n\
                 quad = [[0,0,0],[1,0,0],[0,1,0]]\npatches = [100, 100]\n";
    folder.write("s.toml", scene);
    let job = "scene = \"s.toml\"\nmethod.walk = \"jacobi\"\nbudget.paths = 100000000000\n";
    let path = folder.write("j.toml", job);
    let chain_rays = |set: &[String]| load(&path, set).unwrap().method.batch_paths;
    assert_eq!(chain_rays(&[]), Some(1 << 24));
    assert_eq!(chain_rays(&["method.batch_paths=50000000".into()]), Some(50_000_000));
}

#[test]
fn the_length_of_chains_is_part_of_the_answer() {
    let hash = |set: &[&str]| job_hash([0; 32], &cube54(set).method, &[], [&[]; 2], 1);
    let short = hash(&["method.walk=jacobi", "budget.paths=80000", "method.batch_paths=2000"]);
    let more = hash(&["method.walk=jacobi", "budget.paths=90000", "method.batch_paths=2000"]);
    let long = hash(&["method.walk=jacobi", "budget.paths=80000", "method.batch_paths=4000"]);
    assert_eq!(short, more, "more chains of the same length are the same answer, further on");
    assert_ne!(short, long);
    assert_ne!(short, hash(&["budget.paths=80000"]));
}

#[test]
fn a_range_begins_with_a_whole_chain() {
    let jacobi = ["method.walk=jacobi", "budget.paths=80000", "method.batch_paths=2000"];
    assert_eq!(cube54(&[&jacobi[..], &["budget.first_path=6000"]].concat()).budget.first_path, 6000);
    let refused = load_cube54(&[&jacobi[..], &["budget.first_path=5001"]].concat()).unwrap_err().to_string();
    assert!(refused.contains("5001 begins no batch of 2000 rays (a chain)"), "{refused}");
}

#[test]
fn rays_of_chains_follow_sobol_sequences() {
    let jacobi = ["method.walk=jacobi", "budget.paths=100000"];
    assert_eq!(cube54(&[&jacobi[..], &["method.sampler=sobol"]].concat()).method.sampler, Sampler::Sobol);
    let refused = load_cube54(&[&jacobi[..], &["method.sampler=random"]].concat()).unwrap_err().to_string();
    assert!(refused.contains("method.sampler") && refused.contains("remove the key"), "{refused}");
    // Walks that chains fell back to do not, whatever was asked of the chains.
    let few = cube54(&["method.walk=jacobi", "budget.paths=1000", "method.sampler=sobol"]);
    assert_eq!(few.method.sampler, Sampler::Random);
}

/// 54 patches ask for 32 · 54 = 1,728 rays a chain, 13,824 in all.
#[test]
fn too_few_rays_per_patch_fall_back_to_walks_and_say_so() {
    let few = cube54(&["method.walk=jacobi", "budget.paths=13823"]);
    assert_eq!((few.method.walk, few.method.sampler), (WalkKind::Shooting, Sampler::Random));
    let note = few.note.unwrap();
    assert!(note.contains("1727 rays") && note.contains("budget.paths ≥ 13824"), "{note}");
    assert_eq!(cube54(&["method.walk=jacobi", "budget.paths=13824"]).method.walk, WalkKind::Jacobi);
}

#[test]
fn auto_takes_chains_where_they_are_long_enough() {
    let walk = |set: &[&str]| {
        let job = cube54(&[&["method.walk=auto"], set].concat());
        assert_eq!(job.note, None, "auto gets what it asks for");
        job.method.walk
    };
    assert_eq!(walk(&["budget.paths=13824"]), WalkKind::Jacobi);
    assert_eq!(walk(&["budget.paths=13823"]), WalkKind::Shooting);
    assert_eq!(walk(&["budget.paths=13824", "method.space=continuous"]), WalkKind::Shooting);
    assert_eq!(walk(&["budget.paths=13824", "method.estimator=infinite"]), WalkKind::Shooting);
}

#[test]
fn chains_may_iterate_as_bs_has_it() {
    let jacobi = ["method.walk=jacobi", "budget.paths=7100000"];
    let job = |set: &[&str]| load_cube54(&[&jacobi[..], set].concat());
    assert_eq!(job(&[]).unwrap().method.jacobi, Solve::Links);
    assert_eq!(job(&["method.jacobi={ solve = \"links\" }"]).unwrap().method.jacobi, Solve::Links);
    let plain = job(&["method.jacobi.solve=iterations"]).unwrap().method;
    assert_eq!((plain.jacobi, plain.sampler), (Solve::Iterations(Iterations::default()), Sampler::Random));
    let special = job(&["method.jacobi.solve=iterations", "method.sampler=sobol"]).unwrap().method;
    let expected = Iterations { sampler: Sampler::Sobol, ..Iterations::default() };
    assert_eq!((special.jacobi, special.sampler), (Solve::Iterations(expected), Sampler::Sobol));
    let hash = |set: &[&str]| job_hash([0; 32], &job(set).unwrap().method, &[], [&[]; 2], 1);
    let iterations = "method.jacobi.solve=iterations";
    let variants = [vec![], vec![iterations], vec![iterations, "method.sampler=sobol"]];
    let hashes: std::collections::HashSet<_> = variants.iter().map(|set| hash(set)).collect();
    assert_eq!(hashes.len(), variants.len(), "each is another answer");
    // 1,024 rays per patch and chain.
    let walk = |set: &[&str]| job(set).unwrap().method.walk;
    assert_eq!(walk(&[iterations, "budget.paths=442368"]), WalkKind::Jacobi);
    assert_eq!(walk(&[iterations, "budget.paths=442367"]), WalkKind::Shooting);
}

#[test]
fn what_makes_no_sense_for_chains_is_refused() {
    let refused = |set: &[&str], part: &str| {
        let message = load_cube54(&[&["budget.paths=80000"], set].concat()).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    };
    let iterations = "method.jacobi.solve=iterations";
    refused(&[iterations], "walk = \"shooting\" does not use this key");
    refused(&["method.walk=auto", iterations], "walk = \"auto\" does not use this key");
    let jacobi = "method.walk=jacobi";
    refused(&[jacobi, "method.jacobi={}"], "solve = \"iterations\" beside it");
    refused(&[jacobi, iterations, "method.jacobi.births=systematic"], "unknown key");
}

#[test]
fn a_final_gather_takes_batches_and_few_patches() {
    let job =
        |set: &[&str]| cube54(&[&["budget.paths=1000000", "method.final_gather=[53, 0, 7]"], set].concat());
    let method = job(&[]).method;
    assert_eq!((method.batch_paths, &method.final_gather), (Some(1 << 15), &vec![0, 7, 53]));
    let score = BatchScore::FinalGather(vec![0, 7, 53]);
    let batches = Batches { walks: 1 << 15, sampler: Sampler::Random, score };
    assert_eq!(method.walks(), batches.into());
    assert_eq!(job(&["method.walk=jacobi"]).method.batch_paths, Some(125_000));
    assert_eq!(job(&["method.walk=auto"]).method.walk, WalkKind::Jacobi);
    // Too few rays for chains: batches of walks.
    let few = job(&["method.walk=jacobi", "budget.paths=1600"]);
    assert_eq!((few.method.walk, few.method.batch_paths), (WalkKind::Shooting, Some(64)));
    let refused =
        load_cube54(&["budget.paths=1000000", "method.final_gather=[0, 1, 2, 3]"]).unwrap_err().to_string();
    assert!(refused.contains("4 of 54 patches are chosen") && refused.contains("at most 3"), "{refused}");
}

#[test]
fn sobol_walks_come_in_batches() {
    let sobol = "method.sampler=sobol";
    let batch = |set: &[&str]| cube54(&[&[sobol], set].concat()).method.batch_paths;
    assert_eq!(
        batch(&["budget.paths=1000000"]),
        Some(1 << 15),
        "the greatest power of 2 of which there are 16"
    );
    assert_eq!(batch(&["budget.paths=1000000", "method.batch_paths=100000"]), Some(100_000));
    let method = cube54(&[sobol, "budget.paths=1000000"]).method;
    assert_eq!(
        (method.sampler, method.walks()),
        (Sampler::Sobol, radiosity::Method::batches(1 << 15, Sampler::Sobol))
    );
    let refused = |set: &[&str], part: &str| {
        let message = load_cube54(&[&[sobol], set].concat()).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    };
    refused(&["method.walk=gathering"], "\"sobol\" is for shooting walks");
    refused(&["method.mix=true"], "\"sobol\" is for shooting walks");
    refused(&["budget.paths=7"], "7 paths make 7 batches");
    refused(&["budget.paths=1000", "method.batch_paths=300"], "choose batch_paths ≤ 125");
    refused(&["budget.paths=1600", "budget.first_path=7"], "begins no batch of 64 walks");
}
