// SPDX-License-Identifier: Apache-2.0
#include "interruptible.h"

#include <pthread.h>
#include <pybind11/pybind11.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

namespace py = pybind11;

namespace prescene::python {
namespace {

using Clock = std::chrono::steady_clock;

// Between two looks at whether a signal came: short for a person, long for the GIL, which each look takes.
constexpr std::chrono::milliseconds kSignalInterval{50};

std::atomic<bool> has_worked{false};
std::atomic<bool> lacks_threads{false};

// Of async-signal-safe calls only, as the child of a fork() runs it.
extern "C" void note_fork() {
  if (has_worked) lacks_threads = true;
}

void check_process() {
  static const int watched = pthread_atfork(nullptr, nullptr, note_fork);
  if (watched != 0) throw std::runtime_error("prescene: pthread_atfork failed: out of memory");
  if (lacks_threads) {
    throw std::runtime_error(
        "this process was forked from one that had worked with prescene, and lacks its threads: start processes with "
        "multiprocessing.get_context('spawn'), or use prescene only after the fork");
  }
  has_worked = true;
}

/// The GIL, given away. Not in a destructor: Python ends a thread that asks for the GIL while the interpreter shuts
/// down by unwinding its stack, which a destructor would not let through.
class GilAway {
 public:
  GilAway() : state_(PyEval_SaveThread()) {}
  GilAway(const GilAway&) = delete;
  GilAway& operator=(const GilAway&) = delete;
  void take() {
    if (state_ != nullptr) PyEval_RestoreThread(std::exchange(state_, nullptr));
  }
  void give() {
    if (state_ == nullptr) state_ = PyEval_SaveThread();
  }

 private:
  PyThreadState* state_;
};

/// A thread that is never left behind, whatever unwinds the stack.
class JoinedThread {
 public:
  JoinedThread(core::Cancellation& cancellation, std::function<void()> work)
      : cancellation_(cancellation), thread_(std::move(work)) {}
  JoinedThread(const JoinedThread&) = delete;
  JoinedThread& operator=(const JoinedThread&) = delete;
  ~JoinedThread() {
    if (!thread_.joinable()) return;
    cancellation_.request();
    thread_.join();
  }
  void join() { thread_.join(); }

 private:
  core::Cancellation& cancellation_;
  std::thread thread_;
};

/// What a handler of a signal raised, put aside while the GIL is away.
struct Raised {
  PyObject* type = nullptr;
  PyObject* value = nullptr;
  PyObject* traceback = nullptr;
};

struct Shared {
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  std::exception_ptr error;
};

}  // namespace

bool process_lacks_threads() { return lacks_threads; }

void run_interruptibly(core::Cancellation& cancellation, const std::function<void()>& work) {
  check_process();
  Shared shared;
  Raised raised;
  bool interrupted = false;
  GilAway gil;
  try {
    JoinedThread thread(cancellation, [&shared, &work] {
      std::exception_ptr error;
      try {
        work();
      } catch (...) {
        error = std::current_exception();
      }
      const std::lock_guard lock(shared.mutex);
      shared.error = error;
      shared.done = true;
      shared.changed.notify_all();
    });
    for (;;) {
      {
        std::unique_lock lock(shared.mutex);
        if (shared.changed.wait_for(lock, kSignalInterval, [&shared] { return shared.done; })) break;
      }
      if (interrupted) continue;
      gil.take();
      if (PyErr_CheckSignals() != 0) {
        PyErr_Fetch(&raised.type, &raised.value, &raised.traceback);
        interrupted = true;
        cancellation.request();
      }
      gil.give();
    }
    thread.join();
  } catch (const std::exception&) {  // no thread could be made
    gil.take();
    throw;
  }
  gil.take();
  if (interrupted) {
    PyErr_Restore(raised.type, raised.value, raised.traceback);
    throw py::error_already_set();
  }
  if (shared.error) std::rethrow_exception(shared.error);
}

void in_blocks(std::size_t count, std::size_t block, const std::function<void(std::size_t, std::size_t)>& body) {
  GilAway gil;
  Clock::time_point last = Clock::now();
  try {
    for (std::size_t begin = 0; begin < count; begin += block) {
      body(begin, std::min(begin + block, count));
      const Clock::time_point now = Clock::now();
      if (now - last < kSignalInterval) continue;
      last = now;
      gil.take();
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      gil.give();
    }
  } catch (const std::exception&) {
    gil.take();
    throw;
  }
  gil.take();
}

}  // namespace prescene::python
