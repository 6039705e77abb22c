#pragma once
// What keeps a NaN on its way to a bound. scripts/check-nan finds what does not.

#include "numeric/larger.h"

namespace gewebe::test {

using gewebe::numeric::larger;
using gewebe::numeric::smaller;

} // namespace gewebe::test
