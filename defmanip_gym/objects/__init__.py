"""Objects to carry: from model files, ready for certificates and for the rig."""
