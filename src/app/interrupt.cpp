// SPDX-License-Identifier: MIT
#include "src/app/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include "src/core/error.h"

namespace firn {
namespace {

std::atomic<bool> stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

void on_signal(int) {
  if (stop.exchange(true)) ::_exit(static_cast<int>(ExitCode::interrupted));
}

}  // namespace

std::atomic<bool>& stop_flag() { return stop; }

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

}  // namespace firn
