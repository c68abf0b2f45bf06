#pragma once

#include "client/study/reach.h"

namespace oblique::client {

/// Looks into what the verbs take as points, by solving falls here.
ReachCheck tip_reach();

}  // namespace oblique::client
