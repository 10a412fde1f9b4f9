from robsim.studies.api import open_study as open_study
from robsim.studies.api import study as study
from robsim.studies.outcome_counts import OutcomeCounts as OutcomeCounts
from robsim.studies.study_result import StudyResult as StudyResult
from robsim.suites.bench import bench as bench
from robsim.suites.benchmark import Benchmark as Benchmark
from robsim.suites.suite import Suite as Suite
