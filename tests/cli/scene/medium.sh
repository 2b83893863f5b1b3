# SPDX-License-Identifier: Apache-2.0
# A medium that this version does not have is not ignored, used or not.
echo '<scene version="3.0.0"><medium type="mist" id="fog"/></scene>' | importon render --dump -
