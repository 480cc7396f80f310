// SPDX-License-Identifier: MIT
// All of firn's library.
#pragma once
#include "firn/check.h"
#include "firn/error.h"
#include "firn/observer.h"
#include "firn/picture.h"
#include "firn/points.h"
#include "firn/renderer.h"
#include "firn/scene.h"
#include "firn/session.h"
#include "firn/simulation.h"
#include "firn/version.h"
