#include "tests/system/slurm/slurm_cluster.h"

#include <pwd.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>
#include <stdexcept>

namespace oblique::test {
namespace {

/// Returns the path of a program in PATH or sbin; empty if it is not installed.
std::string installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(std::string(path == nullptr ? "" : path) + ":/usr/sbin:/sbin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string file = folder + "/" + program;
    if (access(file.c_str(), X_OK) == 0) {
      return file;
    }
  }
  return {};
}

std::string user() {
  const passwd* entry = getpwuid(geteuid());
  return entry == nullptr ? std::string() : std::string(entry->pw_name);
}

/// Configuration with short intervals, without accounting, limits and checks of the node size.
constexpr const char* kConfiguration = R"(
ClusterName=oblique
SlurmctldHost=localhost(127.0.0.1)
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
AuthType=auth/munge
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,bf_interval=1
SlurmdParameters=config_overrides
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
KillWait=5
MessageTimeout=3
ReturnToService=2
PartitionName=work Nodes=ALL Default=YES State=UP PriorityTier=10 PreemptMode=REQUEUE
PartitionName=grace Nodes=ALL State=UP PriorityTier=10 PreemptMode=REQUEUE GraceTime=30
PartitionName=urgent Nodes=ALL State=UP PriorityTier=100
)";

}  // namespace

std::string SlurmCluster::unavailable_reason() {
  for (const char* program : {"munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue",
                              "scancel", "scontrol", "sinfo", "setpriv"}) {
    if (installed(program).empty()) {
      return std::string(program) +
             " is not installed: on Debian it is in munge, slurmctld, slurmd, slurm-client or "
             "util-linux";
    }
  }
  return user().empty() ? "the user of this process has no name" : "";
}

SlurmCluster::SlurmCluster(const TemporaryFolder& folder) : folder_(folder) {
  write_configuration();
  start_authentication();
  controller_ = started("slurmctld", {"-D"});
  for (const char* node : {"n1", "n2"}) {
    nodes_.push_back(started("slurmd", {"-D", "-N", node}));
  }
  wait_for_nodes();
}

SlurmCluster::~SlurmCluster() {
  nodes_.clear();
  controller_.reset();
  authentication_.reset();
  // Jobs and slurmstepd are not our children, but they inherit our environment.
  for (auto left = processes_of(folder_); !left.empty(); left = processes_of(folder_)) {
    for (const pid_t pid : left) {
      kill(pid, SIGKILL);
    }
    left.erase(std::remove_if(left.begin(), left.end(), [](pid_t pid) { return !is_running(pid); }),
               left.end());
    if (left.empty()) {
      return;
    }
    usleep(1000);
  }
}

Environment SlurmCluster::environment() const {
  return {{"SLURM_CONF", folder_.file("slurm.conf")}};
}

void SlurmCluster::write_configuration() const {
  for (const char* folder : {"state", "spool-n1", "spool-n2"}) {
    std::filesystem::create_directory(folder_.path() / folder);
  }
  const auto in = [this](const std::string& name) { return folder_.file(name) + "\n"; };
  std::ofstream file(folder_.file("slurm.conf"));
  file << kConfiguration << "SlurmUser=" << user() << "\nSlurmdUser=" << user()
       << "\nSlurmctldPort="
       << controller_port_.number()
       // Credentials expire after 5 s, because a requeued job waits until its credential has
       // expired.
       << "\nAuthInfo=cred_expire=5,socket=" << in("munge.socket")
       << "StateSaveLocation=" << in("state") << "SlurmdSpoolDir=" << in("spool-%n")
       << "SlurmctldPidFile=" << in("slurmctld.pid") << "SlurmdPidFile=" << in("slurmd-%n.pid")
       << "SlurmctldLogFile=" << in("slurmctld.log") << "SlurmdLogFile=" << in("slurmd-%n.log");
  for (const auto& [node, port] :
       {std::pair("n1", &first_node_port_), {"n2", &second_node_port_}}) {
    file << "NodeName=" << node
         << " NodeHostname=localhost NodeAddr=127.0.0.1 CPUs=1 Port=" << port->number() << "\n";
  }
}

void SlurmCluster::start_authentication() {
  {
    std::random_device source;
    std::ofstream key(folder_.file("munge.key"), std::ios::binary);
    for (int i = 0; i < 256; ++i) {
      key.put(static_cast<char>(source()));
    }
  }
  chmod(folder_.file("munge.key").c_str(), 0600);
  // munged requires a folder that other users can access; --force turns this error into a warning.
  authentication_ = started(
      "munged",
      {"--foreground", "--force", "--socket=" + folder_.file("munge.socket"),
       "--key-file=" + folder_.file("munge.key"), "--log-file=" + folder_.file("munged.log"),
       "--pid-file=" + folder_.file("munged.pid"), "--seed-file=" + folder_.file("munged.seed")});
  wait_until("munged listens", [this] {
    if (authentication_->exit_code()) {
      throw std::runtime_error("munged ended: " + authentication_->err());
    }
    return std::filesystem::exists(folder_.file("munge.socket"));
  });
}

std::unique_ptr<Process> SlurmCluster::started(const std::string& program,
                                               const std::vector<std::string>& arguments) const {
  // setpriv makes the kernel kill the daemons when this process ends.
  std::vector<std::string> words{"--pdeathsig", "KILL", installed(program)};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return std::make_unique<Process>(folder_, installed("setpriv"), words, environment());
}

void SlurmCluster::wait_for_nodes() const {
  wait_until("Slurm's nodes are idle; its log: " + log(), [this] {
    const auto states =
        Process(folder_, installed("sinfo"), {"-h", "-N", "-p", "work", "-o", "%T"}, environment())
            .outcome();
    usleep(50'000);
    return states.out == "idle\nidle\n";
  });
}

std::string SlurmCluster::run(const std::string& program, const std::vector<std::string>& arguments,
                              const Environment& more) const {
  Environment all = environment();
  all.insert(more.begin(), more.end());
  auto ran = Process(folder_, installed(program), arguments, all).outcome();
  if (ran.exit_code != 0) {
    throw std::runtime_error(program + ": " + ran.err + log());
  }
  while (ran.out.ends_with('\n')) {
    ran.out.pop_back();
  }
  return ran.out;
}

std::string SlurmCluster::field_of(const std::string& job, const std::string& field) const {
  const auto shown =
      Process(folder_, installed("scontrol"), {"show", "job", "--oneliner", job}, environment())
          .outcome();
  const std::string mark = " " + field + "=";
  const auto at = shown.out.find(mark);
  if (shown.exit_code != 0 || at == std::string::npos) {
    return {};
  }
  const auto from = at + mark.size();
  return shown.out.substr(from, shown.out.find_first_of(" \n", from) - from);
}

void SlurmCluster::wait_for_state(const std::string& job, const std::string& state) const {
  std::string last;
  try {
    wait_until("state " + state, [&] {
      last = field_of(job, "JobState");
      usleep(20'000);
      return last == state;
    });
  } catch (const std::runtime_error&) {
    throw std::runtime_error("job " + job + " is not " + state + " but " + last + "; " + log());
  }
}

void SlurmCluster::begin_now(const std::string& job) const {
  wait_for_state(job, "PENDING");
  // A node refuses a job that starts in the same second in which the job was revoked.
  const std::time_t revoked = std::time(nullptr);
  wait_until("the next second", [&] { return std::time(nullptr) > revoked; });
  run("scontrol", {"update", "JobId=" + job, "StartTime=now"});
}

std::string SlurmCluster::log() const {
  constexpr std::size_t kMax = 4000;
  std::ifstream file(folder_.file("slurmctld.log"));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  return text.size() > kMax ? text.substr(text.size() - kMax) : text;
}

}  // namespace oblique::test
