#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Installs the packages of a folder on a bare system, each step with no more than apt takes for it, uses them as people do
# and removes them. It changes the system that it runs on: .ci/chroot makes one for it.
#
# usage: try.sh FOLDER
set -uo pipefail
cd "${1:?try.sh wants the folder of the packages}" || exit 2
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8
passed=0
failed=0
library=$(dpkg-deb -f ./libfirn[0-9]*.deb Package)  # with the version of its soname
work=$(mktemp -d)
chmod 755 "$work"

check() {  # check SENTENCE COMMAND...: counts; what the command says is shown if it fails
  if "${@:2}" >"$work/said" 2>&1; then
    passed=$((passed + 1))
    echo "ok: $1"
  else
    failed=$((failed + 1))
    echo "FAILED: $1"
    tail -n 20 "$work/said"
  fi
}

install() { apt-get -q -y install --no-install-recommends "$@"; }
absent() { ! dpkg-query -W -f='${db:Status-Status}\n' "$1" 2>/dev/null | grep -qx installed; }
run_scene() { firn run /usr/share/firn/scenes/two_snowballs.toml --quick --frames 0-1 --out "$work/run" && [ -s "$work/run/frames/0001.png" ]; }
complete() {
  bash -uc 'source /usr/share/bash-completion/completions/firn; COMP_WORDS=(firn res); COMP_CWORD=1; _firn; [ "${COMPREPLY[*]}" = resume ]'
}
page() { zcat "/usr/share/man/$1" | grep -q '^\.SH NAME'; }
sums() { for package in firn "$library" libfirn-dev python3-firn; do [ -z "$(dpkg --verify "$package")" ] || return 1; done; }
compile() {
  # shellcheck disable=SC2046
  g++ -std=c++20 -Wall -Wextra -Werror /usr/share/doc/firn/examples/session.cpp $(pkg-config --cflags --libs firn) -o "$work/session"
}
example() { (cd "$work" && "$1" /usr/share/firn/scenes/two_snowballs.toml "$2" 2 && firn info "$2"); }
use_cmake() {  # use_cmake COMPONENTS TARGET
  mkdir -p "$work/cmake$1"
  printf '%s\n' 'cmake_minimum_required(VERSION 3.19)' 'project(uses_firn CXX)' "find_package(firn REQUIRED $1)" \
    'add_executable(scene /usr/share/doc/firn/examples/scene.cpp)' "target_link_libraries(scene $2)" >"$work/cmake$1/CMakeLists.txt"
  cmake -S "$work/cmake$1" -B "$work/cmake$1/build" && cmake --build "$work/cmake$1/build" && (cd "$work" && "cmake$1/build/scene" "made$1")
}
leftovers() {
  local left
  left=$(find / -xdev -iname '*firn*' -not -path "$PWD/*" -not -path "$work*" -not -path '/proc/*' -not -path '/var/cache/apt/*')
  left+=$(ldconfig -p | grep firn)
  echo "$left"
  [ -z "$left" ]
}

check "apt's lists" apt-get -q update
check "firn alone is installed" install ./firn_*.deb
check "without its library" absent "$library"
check "firn --version" firn --version
check "a scene of the package makes pictures" run_scene
check "firn(1)" page man1/firn.1.gz
check "firn-scene(5)" page man5/firn-scene.5.gz
check "bash completes" complete
check "completion for zsh" test -s /usr/share/zsh/vendor-completions/_firn
check "completion for fish" test -s /usr/share/fish/vendor_completions.d/firn.fish
check "documents" test -s /usr/share/doc/firn/docs/library.md
check "licence" grep -q Permission /usr/share/doc/firn/copyright
check "the library is installed" install ./"$library"_*.deb
check "the loader knows it" bash -c "ldconfig -p | grep -qF libfirn.so.${library#libfirn}"
check "libfirn-dev is installed" install ./libfirn-dev_*.deb
check "the Python module is installed" install ./python3-firn_*.deb
check "it runs an example" python3 -W error /usr/share/doc/firn/examples/python/falling_ball.py
check "no file differs from its sum" sums
check "compiler, pkg-config and CMake are installed" install g++ pkg-config cmake make
check "an example is compiled" compile
check "it runs, is interrupted and goes on" example "$work/session" example
check "CMake, shared" use_cmake "" firn::firn
check "what libfirn-dev recommends is installed" bash -c 'apt-get -q -y install --no-install-recommends $(dpkg-query -W -f="\${Recommends}" libfirn-dev | tr -d ,)'
check "CMake, static" use_cmake "COMPONENTS static" firn::firn-static
check "all are removed" apt-get -q -y purge firn "$library" libfirn-dev python3-firn
check "nothing is left" leftovers
rm -rf "$work"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
