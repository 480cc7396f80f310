// SPDX-License-Identifier: MIT
#include "python/src/work.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

namespace firn::python {
namespace {

constexpr auto kLook = std::chrono::milliseconds(50);
constexpr int kLooksPerWatch = 2;

// What the two threads share.
class Finish {
 public:
  void set(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    error_ = std::move(error);
    done_ = true;
    changed_.notify_all();
  }
  bool wait() {  // for a moment, while others may run Python
    const py::gil_scoped_release unlocked;
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLook, [this] { return done_; });
  }
  void rethrow() {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::exception_ptr error_;
};

// Runs Python's signal handlers, if this is its main thread.
void look_for_signals() {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

bool wants_stop(const py::object& watch) { return !watch.is_none() && watch().cast<bool>(); }

void join(std::thread& thread) {
  const py::gil_scoped_release unlocked;
  thread.join();
}

std::exception_ptr outcome_of(const std::function<void()>& work) {
  try {
    work();
  } catch (...) {
    return std::current_exception();
  }
  return nullptr;
}

// Threads of run_alone() that nobody waits for any more.
std::mutex abandoned_mutex;
std::condition_variable abandoned_changed;
int at_work = 0;

void count_worker(int change) {
  const std::lock_guard lock(abandoned_mutex);
  at_work += change;
  abandoned_changed.notify_all();
}

void wait_for_abandoned() {
  const py::gil_scoped_release unlocked;
  std::unique_lock lock(abandoned_mutex);
  abandoned_changed.wait(lock, [] { return at_work == 0; });
}

// Works of run_watched() that are under way, each with its stop. Only touched with the lock of the
// interpreter.
std::vector<std::stop_source>& under_way() {
  static auto& all = *new std::vector<std::stop_source>;
  return all;
}

class UnderWay {
 public:
  explicit UnderWay(const std::stop_source& stop) : stop_(stop) { under_way().push_back(stop); }
  ~UnderWay() { std::erase(under_way(), stop_); }
  UnderWay(const UnderWay&) = delete;
  UnderWay& operator=(const UnderWay&) = delete;

 private:
  std::stop_source stop_;
};

// Daemon threads that are inside of firn when the interpreter ends get out of it first.
void stop_all() {
  for (std::stop_source& stop : under_way()) stop.request_stop();
  while (!under_way().empty()) {
    const py::gil_scoped_release unlocked;
    std::this_thread::sleep_for(kLook);
  }
}

// A process that ends by an interrupt that nobody caught is killed by its signal: nothing is taken down under
// a thread that still works.
void at_exit() {
  stop_all();
  const py::object last = py::getattr(py::module_::import("sys"), "last_type", py::none());
  if (last.is(py::handle(PyExc_KeyboardInterrupt))) return;
  wait_for_abandoned();
}

}  // namespace

void run_watched(const std::function<void(const std::stop_token&)>& work, const py::object& watch) {
  std::stop_source stop;
  const UnderWay registered(stop);
  if (wants_stop(watch)) stop.request_stop();  // before anything is done
  Finish finish;
  std::thread thread([&] { finish.set(outcome_of([&] { work(stop.get_token()); })); });
  std::exception_ptr raised;
  for (int looks = 1; !finish.wait(); ++looks) {
    try {
      look_for_signals();
      if (!raised && looks % kLooksPerWatch == 0 && wants_stop(watch)) stop.request_stop();
    } catch (...) {  // the first one counts: work that has been asked to stop is waited for
      if (!raised) raised = std::current_exception();
      stop.request_stop();
    }
  }
  join(thread);
  if (raised) std::rethrow_exception(raised);
  finish.rethrow();
}

void run_alone(std::function<void()> work) {
  const auto finish = std::make_shared<Finish>();
  count_worker(1);
  try {
    std::thread([finish, work = std::move(work)]() mutable {
      std::exception_ptr error = outcome_of(work);
      work = nullptr;  // before anybody is told, so that what it holds is gone
      finish->set(std::move(error));
      count_worker(-1);
    }).detach();
  } catch (...) {
    count_worker(-1);
    throw;
  }
  while (!finish->wait()) look_for_signals();
  finish->rethrow();
}

void bind_work(py::module_& module) {
  module.def("_at_exit", &at_exit, "Waits for threads that an interrupt left behind.");
  py::module_::import("atexit").attr("register")(module.attr("_at_exit"));
}

}  // namespace firn::python
