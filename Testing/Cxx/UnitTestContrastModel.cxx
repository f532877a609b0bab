#include "ContrastModel.h"
