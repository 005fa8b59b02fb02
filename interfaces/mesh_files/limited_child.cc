// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mesh_files/limited_child.h"

#include <fcntl.h>
#include <sys/poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "prescene/core/file_descriptor.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"

#if defined(__has_feature)
#define PRESCENE_HAS_FEATURE(name) __has_feature(name)
#else
#define PRESCENE_HAS_FEATURE(name) 0
#endif

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
using Clock = std::chrono::steady_clock;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || PRESCENE_HAS_FEATURE(address_sanitizer) || \
    PRESCENE_HAS_FEATURE(thread_sanitizer)
constexpr bool kLimitsMemory = false;
#else
constexpr bool kLimitsMemory = true;
#endif

// How the child reports what an exit status alone can't. Others than 0 are taken for crashes.
constexpr int kExitOutOfMemory = 97;
constexpr int kExitThrew = 98;
constexpr int kExitNoLimits = 99;
constexpr int kPipe = 3;  // In the child, after the three standard streams.

std::string reason(int error) { return std::generic_category().message(error); }

// Address space in use: a limit below it would let every allocation of the child fail.
Result<std::size_t> mapped_bytes() {
  const core::FileDescriptor file(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
  std::array<char, 128> text{};
  ssize_t length = -1;
  if (file.number() >= 0) length = ::read(file.number(), text.data(), text.size());
  std::size_t pages = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + std::max<ssize_t>(length, 0), pages);
  if (parsed.ec != std::errc()) {
    return core::unavailable(
        "cannot be started: /proc/self/statm can't be read, so its memory can't be limited; mount /proc");
  }
  return pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

bool limit(int resource, rlim_t soft, rlim_t hard) {
  rlimit now{};
  if (::getrlimit(static_cast<__rlimit_resource_t>(resource), &now) != 0) return false;
  now.rlim_max = std::min(hard, now.rlim_max);
  now.rlim_cur = std::min(soft, now.rlim_max);
  return ::setrlimit(static_cast<__rlimit_resource_t>(resource), &now) == 0;
}

bool limit(int resource, rlim_t value) { return limit(resource, value, value); }

// Closes every file from `first` on.
void close_from(int first) {
  if (::close_range(static_cast<unsigned>(first), ~0U, 0) == 0) return;
  const long end = std::min(::sysconf(_SC_OPEN_MAX), 65536L);
  for (int file = first; file < end; ++file) ::close(file);
}

// Leaves the child with its pipe as descriptor 3 and nowhere else to read from or write to.
bool detach_files(int pipe) {
  if (pipe != kPipe && ::dup2(pipe, kPipe) < 0) return false;
  close_from(kPipe + 1);
  const int nowhere = ::open("/dev/null", O_RDWR);
  for (int stream = 0; stream < kPipe; ++stream) {
    if (nowhere < 0 || ::dup2(nowhere, stream) < 0) ::close(stream);
  }
  if (nowhere > kPipe) ::close(nowhere);
  return true;
}

bool set_limits(std::size_t mapped, const ChildLimits& limits) {
  const auto seconds = static_cast<rlim_t>(std::chrono::ceil<std::chrono::seconds>(limits.time).count());
  // Not dumpable: a limit on core files does not hold where the system pipes them to a program.
  return ::prctl(PR_SET_DUMPABLE, 0) == 0 && limit(RLIMIT_CORE, 0) && limit(RLIMIT_FSIZE, 0) &&
         // Beyond the soft limit it ends by SIGXCPU, which says why; at the hard one by SIGKILL, which does not.
         limit(RLIMIT_CPU, seconds + 1, seconds + 2) &&
         (!kLimitsMemory || limit(RLIMIT_AS, mapped + limits.memory_bytes));
}

void restore_default_signals() {
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  for (int number = 1; number < NSIG; ++number) {
    // Ctrl-C goes to the whole group of processes; it is for the parent to heed.
    action.sa_handler = number == SIGINT || number == SIGPIPE ? SIG_IGN : SIG_DFL;  // NOLINT(*-pro-type-union-access)
    ::sigaction(number, &action, nullptr);
  }
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

// Where children's ends are reported to nobody, none is kept to be waited for, and its number may be another's next.
bool ends_are_lost() {
  struct sigaction action {};
  if (::sigaction(SIGCHLD, nullptr, &action) != 0) return false;
  const bool ignored = (action.sa_flags & SA_SIGINFO) == 0 && action.sa_handler == SIG_IGN;  // NOLINT(*-union-access)
  return ignored || (action.sa_flags & SA_NOCLDWAIT) != 0;
}

[[noreturn]] void end_out_of_memory() { ::_exit(kExitOutOfMemory); }

// Ends by _exit: destructors and what was registered for the end are the parent's.
[[noreturn]] void be_child(const std::function<void(ChildOutput&)>& work, const ChildLimits& limits, std::size_t mapped,
                           int pipe, pid_t parent) {
  restore_default_signals();
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kExitNoLimits);
  if (!detach_files(pipe) || !set_limits(mapped, limits)) ::_exit(kExitNoLimits);
  std::set_new_handler(end_out_of_memory);
  try {
    ChildOutput out(kPipe);
    work(out);
  } catch (const std::bad_alloc&) {
    ::_exit(kExitOutOfMemory);
  } catch (...) {
    ::_exit(kExitThrew);
  }
  ::_exit(0);
}

// A child until it is waited for, so that none is left behind.
class Child {
 public:
  explicit Child(pid_t process) : process_(process) {}
  ~Child() { end(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // How it ended, as waitpid says it; nothing where another in this process has waited for it. One that has closed its
  // pipe without ending is killed; one that was ending already keeps its status.
  std::optional<int> end() {
    if (process_ <= 0) return status_;
    siginfo_t ended{};
    // Without waiting, and leaving it to be waited for: one that is gone must not be killed by its number.
    int found = -1;
    do {
      found = ::waitid(P_PID, static_cast<id_t>(process_), &ended, WEXITED | WNOHANG | WNOWAIT);
    } while (found != 0 && errno == EINTR);
    if (found == 0) {
      ::kill(process_, SIGKILL);
      int status = 0;
      pid_t waited = -1;
      do {
        waited = ::waitpid(process_, &status, 0);
      } while (waited < 0 && errno == EINTR);
      if (waited == process_) status_ = status;
    }
    process_ = -1;
    return status_;
  }

 private:
  pid_t process_;
  std::optional<int> status_;
};

std::string seconds_text(std::chrono::milliseconds time) {
  return number_text(static_cast<double>(time.count()) * 1e-3) + " s";
}

Status out_of_time(const ChildLimits& limits) {
  return core::resource_exhausted("did not finish within " + seconds_text(limits.time));
}

Status status_of_end(std::optional<int> end, const ChildLimits& limits) {
  if (!end)
    return core::unavailable(
        "ended in an unknown way: another part of this process waited for it; wait for one's own children "
        "only");
  const int status = *end;
  if (WIFEXITED(status)) {
    switch (WEXITSTATUS(status)) {
      case 0:
        return core::ok_status();
      case kExitOutOfMemory:
        return core::resource_exhausted("ran out of its " + size_text(limits.memory_bytes) + " of memory");
      case kExitThrew:
        return core::invalid_input("failed with an exception");
      case kExitNoLimits:
        return core::unavailable("cannot be started: the system refuses to limit it");
      default:
        return core::invalid_input("crashed (exit status " + std::to_string(WEXITSTATUS(status)) + ")");
    }
  }
  const int number = WTERMSIG(status);
  if (number == SIGXCPU) return out_of_time(limits);
  if (number == SIGKILL) return core::resource_exhausted("was killed, perhaps because the system is out of memory");
  return core::invalid_input("crashed (signal " + std::to_string(number) + ")");
}

// All bytes until the child closes its pipe.
Status receive(int pipe, const ChildLimits& limits, const core::Cancellation* cancellation,
               std::vector<std::uint8_t>* out) {
  constexpr std::size_t kPiece = std::size_t{1} << 16;
  constexpr int kLookEvery = 100;  // ms, for a cancellation
  const Clock::time_point deadline = Clock::now() + limits.time;
  for (;;) {
    if (cancellation && cancellation->requested()) return core::cancelled("was stopped");
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return out_of_time(limits);
    pollfd waiting{pipe, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(std::min<std::int64_t>(left, kLookEvery)));
    if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
    if (ready < 0) return core::unavailable("cannot be waited for: " + reason(errno));
    const std::size_t before = out->size();
    out->resize(before + kPiece);
    const ssize_t count = ::read(pipe, out->data() + before, kPiece);
    const int error = errno;
    out->resize(before + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    if (count == 0) return core::ok_status();
    if (count < 0 && error != EINTR && error != EAGAIN)
      return core::unavailable("cannot be read from: " + reason(error));
    if (out->size() > limits.output_bytes)
      return core::resource_exhausted("gave more than " + size_text(limits.output_bytes));
  }
}

}  // namespace

void ChildOutput::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) ::_exit(kExitThrew);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

Result<std::vector<std::uint8_t>> run_in_child(const std::function<void(ChildOutput&)>& work, const ChildLimits& limits,
                                               const core::Cancellation* cancellation) {
  if (ends_are_lost())
    return core::unavailable(
        "cannot be started: SIGCHLD is ignored, so how it ends would be unknown; set SIGCHLD to its default");
  std::size_t mapped = 0;
  if (kLimitsMemory) {
    PRESCENE_TRY(mapped, mapped_bytes());
  }
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return core::unavailable("cannot be started: " + reason(errno));
  const core::FileDescriptor from_child(ends[0]);
  core::FileDescriptor to_parent(ends[1]);
  ::fcntl(from_child.number(), F_SETPIPE_SZ, 1 << 20);  // Fewer turns between the two; less is as good.

  // No handler of this process may run in the child.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t parent = ::getpid();
  const pid_t process = ::fork();
  if (process == 0) be_child(work, limits, mapped, to_parent.number(), parent);
  const int error = errno;
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (process < 0) return core::unavailable("cannot be started: " + reason(error));
  Child child(process);
  to_parent.close();

  std::vector<std::uint8_t> out;
  PRESCENE_RETURN_IF_ERROR(receive(from_child.number(), limits, cancellation, &out));
  PRESCENE_RETURN_IF_ERROR(status_of_end(child.end(), limits));
  return out;
}

bool child_memory_is_limited() { return kLimitsMemory; }

}  // namespace prescene::interfaces
