//! The launcher that started this process, read from the environment; workers are named after it.

/// The launchers: name, and the variables of rank and size. The first that is set counts. mpirun within sbatch leaves
/// its processes a Slurm rank that is not theirs, so Slurm comes after MPI; srun may speak PMI too, and its PMI ranks
/// equal its Slurm ranks.
const RANKS: [(&str, &str, Option<&str>); 5] = [
    ("Open MPI", "OMPI_COMM_WORLD_RANK", Some("OMPI_COMM_WORLD_SIZE")),
    ("PMIx", "PMIX_RANK", None),
    ("PMI", "PMI_RANK", Some("PMI_SIZE")),
    ("Slurm", "SLURM_PROCID", Some("SLURM_NTASKS")),
    ("Kubernetes", "JOB_COMPLETION_INDEX", None),
];

/// The name of a worker: its rank under its launcher, if any, then machine and process. `variable` looks up the
/// environment.
pub fn name(variable: impl Fn(&str) -> Option<String>, host: &str, pid: u32) -> String {
    let process = format!("{host}:{pid}");
    let words: Vec<String> = slurm_job(&variable).into_iter().chain(rank(&variable)).collect();
    if words.is_empty() { process } else { format!("{} at {process}", words.join(" ")) }
}

/// Whether a launcher started this process.
pub fn is_there(variable: impl Fn(&str) -> Option<String>) -> bool {
    rank(&variable).is_some()
}

/// The Slurm job as Slurm's own commands write it: JOB, or JOB_TASK of an array; then the step, if there is one.
fn slurm_job(variable: &impl Fn(&str) -> Option<String>) -> Option<String> {
    let number = |name| number(variable, name);
    // Every task of an array, and every part of a heterogeneous job, also has a job number of its own.
    let array = || Some(format!("{}_{}", number("SLURM_ARRAY_JOB_ID")?, number("SLURM_ARRAY_TASK_ID")?));
    let job = array().or_else(|| number("SLURM_JOB_ID"))?;
    let step = number("SLURM_STEP_ID").map_or(String::new(), |step| format!(".{step}"));
    Some(format!("Slurm {job}{step}"))
}

fn rank(variable: &impl Fn(&str) -> Option<String>) -> Option<String> {
    let number = |name| number(variable, name);
    RANKS.iter().find_map(|&(launcher, rank, size)| {
        let rank = number(rank)?;
        let of = size.and_then(number).map_or(String::new(), |size| format!("/{size}"));
        // The job has named Slurm already.
        let launcher = if launcher == "Slurm" { String::new() } else { format!("{launcher} ") };
        Some(format!("{launcher}rank {rank}{of}"))
    })
}

/// A variable that holds a number; no launcher sets anything else.
fn number(variable: &impl Fn(&str) -> Option<String>, name: &str) -> Option<String> {
    variable(name).filter(|value| !value.is_empty() && value.bytes().all(|byte| byte.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The name of a worker with these variables, written as `env` prints them.
    fn named(environment: &str) -> String {
        let variables: Vec<(&str, &str)> =
            environment.split_whitespace().map(|line| line.split_once('=').unwrap()).collect();
        let variable =
            |name: &str| variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned());
        name(variable, "node7", 4711)
    }

    /// Environments as Open MPI 4.1.4, MPICH 4.0.2 and Slurm 22.05.8 made them.
    #[test]
    fn workers_are_called_by_their_launcher_and_rank() {
        for (environment, called) in [
            ("", "node7:4711"),
            // mpirun.openmpi -n 2
            (
                "OMPI_COMM_WORLD_LOCAL_RANK=1 OMPI_COMM_WORLD_LOCAL_SIZE=2 OMPI_COMM_WORLD_NODE_RANK=1 \
                 OMPI_COMM_WORLD_RANK=1 OMPI_COMM_WORLD_SIZE=2 PMIX_NAMESPACE=89260033 PMIX_RANK=1",
                "Open MPI rank 1/2 at node7:4711",
            ),
            // mpirun.openmpi -n 3 within sbatch: two of three were seen with SLURM_PROCID=0
            (
                "OMPI_COMM_WORLD_RANK=2 OMPI_COMM_WORLD_SIZE=3 PMIX_NAMESPACE=67567617 PMIX_RANK=2 \
                 SLURM_JOB_ID=7 SLURM_LOCALID=0 SLURM_NODEID=0 SLURM_NTASKS=3 SLURM_PROCID=0 SLURM_STEP_ID=0",
                "Slurm 7.0 Open MPI rank 2/3 at node7:4711",
            ),
            // another launcher that speaks PMIx: no size
            ("PMIX_NAMESPACE=prterun-node7-1@1 PMIX_RANK=5", "PMIx rank 5 at node7:4711"),
            // mpiexec.hydra -n 2
            (
                "MPI_LOCALNRANKS=2 MPI_LOCALRANKID=1 PMI_FD=8 PMI_RANK=1 PMI_SIZE=2",
                "PMI rank 1/2 at node7:4711",
            ),
            // mpiexec.hydra within sbatch -N1 -n3
            (
                "MPI_LOCALNRANKS=3 MPI_LOCALRANKID=2 PMI_FD=5 PMI_RANK=2 PMI_SIZE=3 SLURM_JOB_ID=7 \
                 SLURM_NTASKS=1 SLURM_PROCID=0 SLURM_STEP_ID=1",
                "Slurm 7.1 PMI rank 2/3 at node7:4711",
            ),
            // srun -n4
            (
                "SLURM_JOBID=1 SLURM_JOB_ID=1 SLURM_LOCALID=1 SLURM_NODEID=1 SLURM_NTASKS=4 SLURM_PROCID=3 \
                 SLURM_STEPID=0 SLURM_STEP_ID=0",
                "Slurm 1.0 rank 3/4 at node7:4711",
            ),
            // srun --mpi=pmi2 -n2
            (
                "PMI_FD=13 PMI_JOBID=2.0 PMI_RANK=1 PMI_SIZE=2 SLURM_JOB_ID=2 SLURM_NTASKS=2 SLURM_PROCID=1 \
                 SLURM_STEP_ID=0",
                "Slurm 2.0 PMI rank 1/2 at node7:4711",
            ),
            // sbatch --array=5-6, in the script itself
            (
                "SLURM_ARRAY_JOB_ID=3 SLURM_ARRAY_TASK_COUNT=2 SLURM_ARRAY_TASK_ID=5 SLURM_ARRAY_TASK_MIN=5 \
                 SLURM_JOB_ID=4 SLURM_LOCALID=0 SLURM_NODEID=0 SLURM_PROCID=0",
                "Slurm 3_5 rank 0 at node7:4711",
            ),
            // sbatch --array=5-6, below srun: the job number of this task is that of the array
            (
                "SLURM_ARRAY_JOB_ID=3 SLURM_ARRAY_TASK_COUNT=2 SLURM_ARRAY_TASK_ID=6 SLURM_JOB_ID=3 \
                 SLURM_NTASKS=1 SLURM_PROCID=0 SLURM_STEP_ID=0",
                "Slurm 3_6.0 rank 0/1 at node7:4711",
            ),
            // srun --het-group=0,1 of a job of 1 and 3 tasks
            (
                "SLURM_HET_SIZE=2 SLURM_JOB_ID=5 SLURM_JOB_ID_HET_GROUP_0=5 SLURM_JOB_ID_HET_GROUP_1=6 \
                 SLURM_LOCALID=1 SLURM_NODEID=1 SLURM_NTASKS=4 SLURM_PROCID=2 SLURM_STEP_ID=0",
                "Slurm 5.0 rank 2/4 at node7:4711",
            ),
            // an Indexed Job
            ("HOSTNAME=node7 JOB_COMPLETION_INDEX=12", "Kubernetes rank 12 at node7:4711"),
            // what is no number is no rank
            ("PMI_RANK= SLURM_PROCID=x JOB_COMPLETION_INDEX=-1 SLURM_JOB_ID=7;rm", "node7:4711"),
        ] {
            assert_eq!(named(environment), called, "{environment}");
        }
    }
}
