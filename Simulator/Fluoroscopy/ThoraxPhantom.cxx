#include "ThoraxPhantom.h"
