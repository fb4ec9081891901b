#!/bin/sh
# Makes this model in the folder given: sh recipe.sh OUT
set -eu
softsense simulate linear -o "$1/linear.csv" --seed 0
softsense build "$1/linear.csv" --size 2 --name linear_pair --seed 0 -o "$1" --on reference,onnxruntime,host
