#include "EvaluationReport.h"
