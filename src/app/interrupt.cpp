// SPDX-License-Identifier: MIT
#include "src/app/interrupt.h"

#include <semaphore.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <climits>
#include <cstring>
#include <mutex>
#include <thread>

#include "src/app/exit_code.h"

namespace firn {
namespace {

std::atomic<bool> stopping{false}, obeyed{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

// In memory that a signal handler may look at whenever it comes.
constexpr int kMostFolders = 16;
char folder_names[kMostFolders][PATH_MAX];
std::atomic<int> folder_count{0};

// A signal handler may not request a stop itself: it wakes a thread that does. Both are there until the
// process ends, whatever has been taken down by then.
sem_t woken;
std::stop_source& source() {
  static auto& made = *new std::stop_source;
  return made;
}

void on_signal(int) {
  if (obeyed && !stopping.exchange(true)) {
    ::sem_post(&woken);
    return;
  }
  for (int i = folder_count; i-- > 0;) ::rmdir(folder_names[i]);
  ::_exit(static_cast<int>(ExitCode::interrupted));
}

}  // namespace

std::stop_token stop_of_signals() {
  static std::once_flag once;
  std::call_once(once, [] {
    ::sem_init(&woken, 0, 0);
    std::thread([] {
      while (::sem_wait(&woken) != 0) {
      }
      source().request_stop();
    }).detach();
    obeyed = true;
  });
  return source().get_token();
}

void remove_when_interrupted(const std::vector<std::filesystem::path>& folders) {
  folder_count = 0;
  int count = 0;
  for (const auto& folder : folders) {
    if (count == kMostFolders || folder.native().size() >= PATH_MAX) break;
    std::strcpy(folder_names[count++], folder.c_str());
  }
  folder_count = count;
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    ::sigaction(number, nullptr, &before);
    if (before.sa_handler != SIG_IGN)
      ::sigaction(number, &action, nullptr);  // as for `firn ... &` in a script
  }
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

}  // namespace firn
