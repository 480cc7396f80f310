// SPDX-License-Identifier: MIT
// An object that one thread may use at a time, although the lock of the interpreter is free while it works.
#pragma once
#include <string>
#include <thread>

#include "firn/error.h"

namespace firn::python {

// All of it happens with the lock of the interpreter held.
class OneUser {
 public:
  // As long as it lives nobody else may begin to use the object. Errors: usage Error if another thread does.
  class Use {
   public:
    // alone: not from within its own work, either.
    Use(OneUser& user, const std::string& what, bool alone = false) : user_(user), nested_(user.busy_) {
      if (nested_ && alone && user.guest_ == std::this_thread::get_id())
        throw Error(ErrorCode::usage, "", what + " is at work: this is called from within it");
      if (nested_ && user.guest_ != std::this_thread::get_id())
        throw Error(ErrorCode::usage, "", what + " is at work in another thread; use it when that has ended");
      user_.busy_ = true;
    }
    ~Use() { user_.busy_ = nested_; }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    OneUser& user_;
    const bool nested_;
  };

  // A thread that the work calls back in, and that may use the object meanwhile.
  class Guest {
   public:
    explicit Guest(OneUser& user) : user_(user) { user_.guest_ = std::this_thread::get_id(); }
    ~Guest() { user_.guest_ = {}; }
    Guest(const Guest&) = delete;
    Guest& operator=(const Guest&) = delete;

   private:
    OneUser& user_;
  };

 private:
  bool busy_ = false;
  std::thread::id guest_;
};

}  // namespace firn::python
