// What a shared library shows of itself: everything that is not marked is hidden.
#pragma once

#define INTERVALE_EXPORT __attribute__((visibility("default")))
